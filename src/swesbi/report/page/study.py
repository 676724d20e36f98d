"""The pages of a study, readable without the workflow, from all that it made."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final, NamedTuple, TypeVar

import pandas as pd
from pydantic import JsonValue

from swesbi import __version__
from swesbi.artefacts import ArtefactError, UnfitError
from swesbi.artefacts.csv import PlainTable
from swesbi.artefacts.typed import ByExperiment, ByPlace, Text, Texts
from swesbi.checks.calibration.alarms import AlarmTable
from swesbi.checks.calibration.table import CalibrationTable
from swesbi.checks.pressures import PressuresTable
from swesbi.networks.training_tables import TrainingTable
from swesbi.persons.cohort.result import CohortPosterior
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.cohort.recording_file import read_recording_file
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.report.figures.population import StrataTable
from swesbi.report.numbers import protocol_entry
from swesbi.report.page.figures import PagePart
from swesbi.report.page.files import file_groups, provenance_table, relative, software_table
from swesbi.report.page.landing import make_landing
from swesbi.report.page.names import FURTHER, LANDING
from swesbi.report.page.page import (
    Cohort,
    Page,
    PageProvenance,
    as_yaml,
    render,
    study_figures,
)
from swesbi.report.page.sections import make_population_section, make_section, section_figures
from swesbi.report.paper.comparison import ComparisonTable, StatementsTable
from swesbi.report.results import Experiment, Recovery, Results
from swesbi.report.tables.cohort_posterior import cohort_section
from swesbi.report.tables.exact import Exact
from swesbi.report.tables.population import PopulationSection
from swesbi.report.tables.pressures import pressures_of
from swesbi.report.tables.validation import RoundsTable, shown_validation
from swesbi.verdict.summary import CohortTable
from swesbi.verdict.verdict import Verdict

Sections = dict[str, dict[str, JsonValue]]
"""Sections of the configuration, by experiment."""
CONFIGURATION: Final = "configuration.yaml"
Item = TypeVar("Item")


class Pages(NamedTuple):
    """The landing page, the pages in the folder beside it, and the configuration."""

    report: Text
    pages: Texts
    configuration: Text


def pages_of_study(
    recording: Path,
    observations: tuple[Observation, ...],
    verdicts: ByPlace[Verdict],
    trainings: ByExperiment[TrainingTable],
    recoveries: ByExperiment[PlainTable],
    recovery_acquisitions: ByExperiment[PlainTable],
    ppc_csv: PlainTable,
    features_csv: PlainTable,
    posterior_csv: PlainTable,
    comparison_csv: ComparisonTable,
    statements_csv: StatementsTable,
    study_pngs: tuple[Path, ...],
    training_pngs: tuple[Path, ...],
    exact_posteriors: ByPlace[ExactPosterior],
    calibrations: ByExperiment[CalibrationTable],
    alarms: ByExperiment[AlarmTable],
    identifiabilities: ByExperiment[PlainTable],
    noise: CohortNoise | None,
    truth_csv: PlainTable | None,
    exact_pngs: tuple[Path, ...],
    population_cohorts: ByExperiment[CohortTable],
    population_strata: ByExperiment[StrataTable],
    population_pngs: tuple[Path, ...],
    pressures_csv: PressuresTable | None,
    cohort_posteriors: ByExperiment[CohortPosterior],
    validation: RoundsTable | None,
    artefacts: tuple[Path, ...],
    *,
    cohort_title: str,
    main_experiment: str,
    experiments_shown: Sections,
    populations_shown: Sections,
    configuration: dict[str, JsonValue],
    seed: int,
    code: str,
) -> Pages:
    """Make the pages, which refer to every file by its path relative to the landing page.

    Figures lie in a folder beside that page. ``artefacts`` are all files of the study. Inputs of experiments
    that are not run are empty.

    Raises:
        ArtefactError: An input is missing for an experiment, a figure is no PNG, or the cohort does not say
            where its recordings come from.
    """
    page, title = study_pngs[0].parents[1] / f"{LANDING}.html", cohort_title
    tables = {"scores": ppc_csv, "features": features_csv, "posterior": posterior_csv}
    by_experiment = (trainings, recoveries, recovery_acquisitions)
    experiments = _experiments(experiments_shown, verdicts, tables, *by_experiment)
    main = next(each for each in experiments if each.name == main_experiment)
    results = Results(observations, experiments, main, comparison_csv, statements_csv)
    checks = {"calibration": calibrations, "alarms": alarms, "identifiability": identifiabilities}
    exact = _exact(experiments, exact_posteriors, checks, noise, truth_csv)
    cohorts = {name: cohort_section(posterior, title) for name, posterior in cohort_posteriors.items()}
    sections = []
    for of_speeds in exact:
        name = of_speeds.experiment.name
        figures = section_figures(PagePart.SPEEDS, exact_pngs, name, page, title)
        sections.append(make_section(of_speeds, figures, title, cohorts.get(name)))
    populations = []
    for shown in _over_populations(populations_shown, population_cohorts, population_strata, pressures_csv):
        figures = section_figures(PagePart.POPULATION, population_pngs, shown.name, page, title)
        populations.append(make_population_section(shown, figures, title, cohorts.get(shown.name)))
    whole = Page(
        results=results,
        landing=make_landing(results, exact, title, [relative(path, page) for path in artefacts]),
        cohort=cohort_in_words(recording, title),
        figures=study_figures(study_pngs, training_pngs, page, main, title),
        sections=sections,
        populations=populations,
        validation=None if validation is None else shown_validation(validation),
        files=file_groups(artefacts, page),
        provenance=_provenance(seed, code, artefacts, as_yaml(configuration)),
    )
    further = {name: render(whole, name) for name in FURTHER}
    return Pages(render(whole), further, whole.provenance.configuration)


def cohort_in_words(recording: Path, title: str) -> Cohort:
    """Return what the cohort says of its own recordings; only ``origin`` is required.

    Raises:
        ArtefactError: It does not say where the recordings come from.
    """
    file = read_recording_file(recording.parent)
    if not file.origin:
        raise ArtefactError(f"{recording}: add `origin`: who or what was recorded, in a few words")
    said = file.protocol.model_dump(exclude_unset=True).items()
    protocol = tuple(protocol_entry(key, value) for key, value in said)
    return Cohort(title, recording.parent.as_posix(), file.origin, protocol)


def _experiments(
    sections: Sections,
    verdicts: ByPlace[Verdict],
    tables: Mapping[str, pd.DataFrame],
    trainings: Mapping[str, pd.DataFrame],
    recoveries: Mapping[str, pd.DataFrame],
    recovery_acquisitions: Mapping[str, pd.DataFrame],
) -> tuple[Experiment, ...]:
    """Return what every experiment has, in the order of their sections."""
    return tuple(
        Experiment(
            name=name,
            settings=plain,
            verdicts=_of_experiment(verdicts, name),
            recovery=Recovery(recoveries[name], recovery_acquisitions[name]),
            training=trainings[name],
            **{kind: _rows(table, name) for kind, table in tables.items()},
        )
        for name, plain in sections.items()
    )


def _exact(
    experiments: Sequence[Experiment],
    posteriors: ByPlace[ExactPosterior],
    checks: Mapping[str, Mapping[str, pd.DataFrame]],
    noise: CohortNoise | None,
    truth: pd.DataFrame | None,
) -> tuple[Exact, ...]:
    """Return what only experiments on speeds have, in the order of the experiments.

    Raises:
        UnfitError: There is such an experiment, and no noise is given.
    """
    chosen = [experiment for experiment in experiments if experiment.exact]
    if chosen and noise is None:
        raise UnfitError("noise", "that of the cohort is not given")
    return tuple(
        Exact(
            experiment=experiment,
            results=_of_experiment(posteriors, experiment.name),
            noise=noise,
            truth=_rows(truth, experiment.name),
            **{kind: tables[experiment.name] for kind, tables in checks.items()},
        )
        for experiment in chosen
        if noise is not None
    )


def _over_populations(
    sections: Sections,
    cohorts: Mapping[str, pd.DataFrame],
    strata: Mapping[str, pd.DataFrame],
    pressures: pd.DataFrame | None,
) -> Iterator[PopulationSection]:
    """Yield the experiments over a population, in the order of their sections."""
    for name, plain in sections.items():
        mass = float(str(plain["interval"]))
        own = pressures_of(pressures, name)
        yield PopulationSection(name, plain, mass, cohorts[name], strata[name], own)


def _of_experiment(files: ByPlace[Item], experiment: str) -> dict[str, Item]:
    """Return what there is of each subject in an experiment; nothing else is read."""
    return {place.subject: files[place] for place in files if place.experiment == experiment}


def _rows(table: pd.DataFrame | None, experiment: str) -> pd.DataFrame:
    """Return the rows of an experiment; none where there is no table."""
    whole = pd.DataFrame(columns=["experiment"]) if table is None else table
    return whole[whole["experiment"] == experiment]


def _provenance(seed: int, code: str, artefacts: Sequence[Path], configuration: str) -> PageProvenance:
    return PageProvenance(
        seed=seed,
        code_hash=code,
        version=__version__,
        artefacts=provenance_table(artefacts),
        software=software_table(),
        configuration=configuration,
        configuration_file=CONFIGURATION,
    )
