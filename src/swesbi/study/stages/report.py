"""The landing page of the results, readable without the workflow."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
import yaml
from pydantic import JsonValue

from swesbi import __version__
from swesbi.artefacts import ArtefactError, atomic_path
from swesbi.base import Settings
from swesbi.posterior.result import read_exact_result
from swesbi.recording.noise import read_noise
from swesbi.recording.observation import read_observation
from swesbi.show.figures.population import read_strata
from swesbi.show.figures.training import read_history
from swesbi.show.numbers import protocol_entry
from swesbi.show.page.exam import ExamSection, make_exam_section, sat_exam, small_exam
from swesbi.show.page.figures import PagePart
from swesbi.show.page.files import file_groups, provenance_table, relative, software_table
from swesbi.show.page.landing import make_landing
from swesbi.show.page.new import new_subjects
from swesbi.show.page.page import Cohort, PageProvenance, as_yaml, make_page, render, study_figures
from swesbi.show.page.sections import (
    PopulationSection,
    Section,
    make_population_section,
    make_section,
    section_figures,
)
from swesbi.show.results import Experiment, Recovery, Results
from swesbi.show.tables.cohort_posterior import CohortSection, cohort_sections
from swesbi.show.tables.exact import Exact
from swesbi.show.tables.exam import read_exam
from swesbi.show.tables.experiments import read_comparison
from swesbi.show.tables.population import OverPopulation
from swesbi.show.tables.pressures import pressures_of
from swesbi.study.stages.origin import Origin, ResultKey, by_key
from swesbi.verdict.answers import read_cohort
from swesbi.verdict.support import read_support


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
                key.subject: read_exact_result(path)
                for key, path in posterior_of.items()
                if key.experiment == experiment.name
            },
            noise=read_noise(noise[0]),
            truth=truths[truths["experiment"] == experiment.name],
            **{kind: _table(paths, kind, experiment.name) for kind, paths in tables.items()},
        )
        for experiment in chosen
    )


def _table(paths: Sequence[Path], kind: str, experiment: str) -> pd.DataFrame:
    by_experiment = {path.parent.name: path for path in paths}
    if experiment not in by_experiment:
        raise ArtefactError(f"experiment {experiment!r}: no file of {kind} is given")
    return pd.read_csv(by_experiment[experiment], converters={"subject": str})


def _truth(paths: Sequence[Path]) -> pd.DataFrame:
    if not paths:
        return pd.DataFrame(columns=["experiment"])
    return pd.read_csv(paths[0], converters={"experiment": str, "subject": str})


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


class ShownExamSettings(Settings):
    """What the page says of the exam.

    Attributes:
        experiment: The experiment whose network answers it.
        interval: Mass of its credible intervals.
        asked: Whether the page is to show the exam that was sat.
    """

    experiment: str
    interval: float
    asked: bool


class ReportSettings(Settings):
    """What the page says of the study's configuration.

    Attributes:
        cohort_title: What the subjects are called.
        main_experiment: The experiment of figures 2 and 3 and of table 1.
        experiments: Section of each experiment shown, its prior as the prior itself.
        populations: Section of each experiment over a population, with the mass of its credible intervals.
        exam: What the page says of the exam.
        configuration: The configuration as the page prints it.
    """

    cohort_title: str
    main_experiment: str
    experiments: dict[str, dict[str, JsonValue]]
    populations: dict[str, dict[str, JsonValue]]
    exam: ShownExamSettings
    configuration: dict[str, JsonValue]


def report(
    *,
    recording: Path,
    observations: Sequence[Path],
    supports: Sequence[Path],
    trainings: Sequence[Path],
    recoveries: Sequence[Path],
    recovery_acquisitions: Sequence[Path],
    ppc_csv: Path,
    features_csv: Path,
    posterior_csv: Path,
    comparison_csv: Path,
    study_pngs: Sequence[Path],
    training_pngs: Sequence[Path],
    exact_posteriors: Sequence[Path],
    calibrations: Sequence[Path],
    misspecifications: Sequence[Path],
    identifiabilities: Sequence[Path],
    noise: Sequence[Path],
    truth_csv: Sequence[Path],
    exact_pngs: Sequence[Path],
    population_cohorts: Sequence[Path],
    population_strata: Sequence[Path],
    population_pngs: Sequence[Path],
    pressures_csv: Sequence[Path],
    cohort_posteriors: Sequence[Path],
    small_exam_csv: Sequence[Path],
    small_exam_png: Sequence[Path],
    exam_sat: Sequence[Path],
    artefacts: Sequence[Path],
    report: Path,
    pages: Sequence[Path],
    configuration: Path,
    settings: ReportSettings,
    origin: Origin,
) -> None:
    """Write the configuration and the pages, which refer to every file by its path relative to themselves.

    ``report`` is the landing page, ``pages`` the further ones in a folder beside it; none is written before
    all have their text.

    What belongs to experiments on speeds or over a population is empty where none is run; ``noise``,
    ``truth_csv``, ``pressures_csv``, ``small_exam_csv``, ``small_exam_png`` and ``exam_sat`` hold one file or
    none.

    Raises:
        ArtefactError: An input is missing for an experiment, or cannot be read.
    """
    title = settings.cohort_title
    tables = {"scores": ppc_csv, "features": features_csv, "posterior": posterior_csv}
    files = {"training": trainings, "own": recoveries, "acquisition": recovery_acquisitions}
    results = _results(settings, observations, supports, tables, files, comparison_csv)
    figures = study_figures(study_pngs, training_pngs, report, results.main, title)
    checks = {"calibration": calibrations, "misspecification": misspecifications}
    checks["identifiability"] = identifiabilities
    exact = read_exact(results.experiments, exact_posteriors, checks, noise, truth_csv)
    cohorts = cohort_sections(cohort_posteriors, title)
    sections = _sections(exact, exact_pngs, report, title, cohorts)
    read = read_populations(settings.populations, population_cohorts, population_strata, pressures_csv)
    populations = [_population(each, population_pngs, report, title, cohorts) for each in read]
    origins = _provenance(settings, origin, artefacts, relative(configuration, report))
    files_shown = file_groups(artefacts, report)
    cohort = _cohort(recording, title)
    exam = _exam(settings.exam, small_exam_csv, small_exam_png, exam_sat, report)
    links = [relative(path, report) for path in artefacts]
    landing = make_landing(results, exact, title, links, new_subjects(report))
    page = make_page(results, landing, cohort, figures, sections, populations, exam, files_shown, origins)
    texts = {report: render(page), **{path: render(page, path.stem) for path in pages}}
    for path, text in {configuration: origins.configuration, **texts}.items():
        _write(path, text)


def _population(
    each: OverPopulation, pngs: Sequence[Path], report: Path, title: str, cohorts: Mapping[str, CohortSection]
) -> PopulationSection:
    figures = section_figures(PagePart.POPULATION, pngs, each.name, report, title)
    return make_population_section(each, figures, title, cohorts.get(each.name))


def _sections(
    exact: Iterable[Exact],
    pngs: Sequence[Path],
    report: Path,
    title: str,
    cohorts: Mapping[str, CohortSection],
) -> list[Section]:
    named = [(each, each.experiment.name) for each in exact]
    return [
        make_section(
            each, section_figures(PagePart.SPEEDS, pngs, name, report, title), title, cohorts.get(name)
        )
        for each, name in named
    ]


def _exam(
    settings: ShownExamSettings,
    tables: Sequence[Path],
    pngs: Sequence[Path],
    sat: Sequence[Path],
    report: Path,
) -> ExamSection | None:
    small = [small_exam(read_exam(table), png, report) for table, png in zip(tables, pngs, strict=True)]
    stored = [sat_exam(path) for path in sat]
    return make_exam_section(
        settings.experiment,
        settings.interval,
        next(iter(small), None),
        settings.asked,
        next(iter(stored), None),
    )


def _provenance(
    settings: ReportSettings, origin: Origin, artefacts: Sequence[Path], configuration: str
) -> PageProvenance:
    return PageProvenance(
        seed=origin.seed,
        code_hash=origin.code_hash,
        version=__version__,
        artefacts=provenance_table(artefacts),
        software=software_table(),
        configuration=as_yaml(settings.configuration),
        configuration_file=configuration,
    )


def _write(path: Path, text: str) -> None:
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _results(
    settings: ReportSettings,
    observations: Sequence[Path],
    supports: Sequence[Path],
    tables: Mapping[str, Path],
    files: Mapping[str, Sequence[Path]],
    comparison: Path,
) -> Results:
    """Read everything that the page shows in numbers."""
    texts = {"experiment": str, "subject": str}
    shown = {name: pd.read_csv(path, converters=texts) for name, path in tables.items()}
    verdicts = by_key(supports)
    of_experiment = {kind: {path.parent.name: path for path in paths} for kind, paths in files.items()}
    experiments = tuple(
        _experiment(name, plain, shown, verdicts, of_experiment)
        for name, plain in settings.experiments.items()
    )
    return Results(
        observations=tuple(map(read_observation, observations)),
        experiments=experiments,
        main=next(each for each in experiments if each.name == settings.main_experiment),
        comparison=read_comparison(comparison),
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
    own, acquisition = (pd.read_csv(files[kind][name]) for kind in ("own", "acquisition"))
    return Experiment(
        name=name,
        settings=plain,
        supports={
            key.subject: read_support(path) for key, path in verdicts.items() if key.experiment == name
        },
        recovery=Recovery(own, acquisition),
        training=read_history(files["training"][name]),
        **{kind: table[table["experiment"] == name] for kind, table in tables.items()},
    )


def _cohort(recording: Path, title: str) -> Cohort:
    """Read what the cohort says of its own recordings; only ``origin`` is required.

    Raises:
        ArtefactError: It does not say where the recordings come from.
    """
    plain = yaml.safe_load(recording.read_text(encoding="utf-8"))
    if not isinstance(plain, dict) or not plain.get("origin"):
        raise ArtefactError(f"{recording}: add `origin`: who or what was recorded, in a few words")
    protocol = tuple(protocol_entry(key, value) for key, value in (plain.get("protocol") or {}).items())
    return Cohort(title, recording.parent.as_posix(), str(plain["origin"]), protocol)
