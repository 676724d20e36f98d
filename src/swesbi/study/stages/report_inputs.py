"""What the pages of the results are made of, read from the files of a study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from pydantic import JsonValue

from swesbi.artefacts import ArtefactError
from swesbi.artefacts.csv import read_csv
from swesbi.posterior.result import read_exact_posterior
from swesbi.recording.cohort.recording_file import read_recording_file
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.report.figures.population import read_strata
from swesbi.report.figures.training import read_history
from swesbi.report.numbers import protocol_entry
from swesbi.report.page.page import Cohort
from swesbi.report.paper.comparison import COLUMNS, STATEMENT_COLUMNS
from swesbi.report.results import Experiment, Recovery, Results
from swesbi.report.tables.exact import Exact
from swesbi.report.tables.experiments import read_as_written
from swesbi.report.tables.population import OverPopulation
from swesbi.report.tables.pressures import pressures_of
from swesbi.study.stages.origin import ResultKey, by_key
from swesbi.verdict.answers import read_cohort
from swesbi.verdict.verdict import read_verdict


def read_results(
    sections: Mapping[str, Mapping[str, JsonValue]],
    main: str,
    observations: Sequence[Path],
    verdicts: Sequence[Path],
    tables: Mapping[str, Path],
    files: Mapping[str, Sequence[Path]],
    paper: tuple[Path, Path],
) -> Results:
    """Read everything that the page shows in numbers.

    Args:
        sections: Of the configuration, by experiment.
        main: The experiment of figures 2 and 3 and of table 1.
        observations: Observed curves of all subjects.
        verdicts: Verdicts of every subject in every experiment.
        tables: By kind, a table of all experiments.
        files: By kind ("training", "own", "acquisition"), a table of each experiment.
        paper: The paper's numbers and statements beside this study.

    Raises:
        ArtefactError: A file of an experiment is missing, or not what its name says.
    """
    shown = {name: read_csv(path) for name, path in tables.items()}
    verdict_of = by_key(verdicts)
    of_experiment = {kind: {path.parent.name: path for path in paths} for kind, paths in files.items()}
    experiments = tuple(
        _experiment(name, plain, shown, verdict_of, of_experiment) for name, plain in sections.items()
    )
    return Results(
        observations=tuple(map(Observation.read, observations)),
        experiments=experiments,
        main=next(each for each in experiments if each.name == main),
        comparison=read_as_written(paper[0], COLUMNS),
        statements=read_as_written(paper[1], STATEMENT_COLUMNS),
    )


def _experiment(
    name: str,
    plain: Mapping[str, Any],
    tables: Mapping[str, pd.DataFrame],
    verdicts: Mapping[ResultKey, Path],
    files: Mapping[str, Mapping[str, Path]],
) -> Experiment:
    if missing := [kind for kind, paths in files.items() if name not in paths]:
        raise ArtefactError(f"experiment {name!r}: no file of {', '.join(missing)} is given")
    own, acquisition = (read_csv(files[kind][name]) for kind in ("own", "acquisition"))
    return Experiment(
        name=name,
        settings=plain,
        verdicts={
            key.subject: read_verdict(path) for key, path in verdicts.items() if key.experiment == name
        },
        recovery=Recovery(own, acquisition),
        training=read_history(files["training"][name]),
        **{kind: table[table["experiment"] == name] for kind, table in tables.items()},
    )


def read_cohort_words(recording: Path, title: str) -> Cohort:
    """Read what the cohort says of its own recordings; only ``origin`` is required.

    Raises:
        ArtefactError: It does not say where the recordings come from.
    """
    file = read_recording_file(recording.parent)
    if not file.origin:
        raise ArtefactError(f"{recording}: add `origin`: who or what was recorded, in a few words")
    said = file.protocol.model_dump(exclude_unset=True).items()
    protocol = tuple(protocol_entry(key, value) for key, value in said)
    return Cohort(title, recording.parent.as_posix(), file.origin, protocol)


def read_exact(
    experiments: Sequence[Experiment],
    posteriors: Sequence[Path],
    tables: Mapping[str, Sequence[Path]],
    noise: Sequence[Path],
    truth: Sequence[Path],
) -> tuple[Exact, ...]:
    """Read what only experiments on speeds have, in the order of the experiments.

    Args:
        experiments: All experiments.
        posteriors: ``posterior.h5`` of every subject in every experiment on speeds.
        tables: By kind, ``<kind>.csv`` of every experiment on speeds.
        noise: The cohort's noise; none without an experiment on speeds.
        truth: ``truth.csv``, or none.

    Raises:
        ArtefactError: A file of an experiment is missing.
    """
    chosen = [experiment for experiment in experiments if experiment.exact]
    if chosen and not noise:
        raise ArtefactError("the cohort's noise is not given")
    truths = _truth(truth)
    posterior_of = by_key(posteriors)
    return tuple(
        Exact(
            experiment=experiment,
            results={
                key.subject: read_exact_posterior(path)
                for key, path in posterior_of.items()
                if key.experiment == experiment.name
            },
            noise=CohortNoise.read(noise[0]),
            truth=truths[truths["experiment"] == experiment.name],
            **{kind: _table(paths, kind, experiment.name) for kind, paths in tables.items()},
        )
        for experiment in chosen
    )


def _table(paths: Sequence[Path], kind: str, experiment: str) -> pd.DataFrame:
    by_experiment = {path.parent.name: path for path in paths}
    if experiment not in by_experiment:
        raise ArtefactError(f"experiment {experiment!r}: no file of {kind} is given")
    return read_csv(by_experiment[experiment])


def _truth(paths: Sequence[Path]) -> pd.DataFrame:
    if not paths:
        return pd.DataFrame(columns=["experiment"])
    return read_csv(paths[0])


def read_populations(
    sections: Mapping[str, Mapping[str, JsonValue]],
    cohorts: Sequence[Path],
    strata: Sequence[Path],
    pressures: Sequence[Path] = (),
) -> tuple[OverPopulation, ...]:
    """Read the experiments over a population, in the order of their sections.

    Args:
        sections: Of the configuration, by experiment, with the mass of the credible intervals.
        cohorts: ``cohort.csv`` of every experiment, in its folder.
        strata: ``strata.csv`` likewise.
        pressures: ``pressures.csv`` of all of them, or none.

    Raises:
        ArtefactError: A file of an experiment is missing, or not what its name says.
    """
    files = {"cohort": cohorts, "strata": strata}
    by_kind = {kind: {path.parent.name: path for path in paths} for kind, paths in files.items()}
    for name in sections:
        if missing := [kind for kind, paths in by_kind.items() if name not in paths]:
            raise ArtefactError(f"experiment {name!r}: no file of {', '.join(missing)} is given")
    return tuple(
        OverPopulation(
            name=name,
            settings=plain,
            interval=float(str(plain["interval"])),
            cohort=read_cohort(by_kind["cohort"][name]),
            strata=read_strata(by_kind["strata"][name]),
            pressures=pressures_of(pressures, name),
        )
        for name, plain in sections.items()
    )
