"""The pages of a study, readable without the workflow, from all that it made."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

import pandas as pd
from pydantic import JsonValue

from swesbi import __version__
from swesbi.artefacts import ArtefactError
from swesbi.artefacts.csv import PlainTable
from swesbi.artefacts.typed import ByExperiment, ByName, ByPlace, Text, Texts
from swesbi.checks.calibration.table import StrataTable
from swesbi.persons.cohort.stored import CohortPosterior
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.cohort.recording_file import read_recording_file
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.report.figures.registry import Scope
from swesbi.report.numbers import protocol_entry
from swesbi.report.page.files import Figure, file_groups, provenance_table, relative, software_table
from swesbi.report.page.landing import make_landing
from swesbi.report.page.names import FURTHER, LANDING
from swesbi.report.page.page import Cohort, as_yaml, render, study_figures, study_tables
from swesbi.report.page.sections import make_population_section, make_section, section_figures
from swesbi.report.paper.comparison import ComparisonTable, StatementsTable
from swesbi.report.results import Experiment, Results, no_rows
from swesbi.report.tables.cohort_posterior import CohortSection, cohort_section
from swesbi.report.tables.population import PopulationSection
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
    exact_posteriors: ByPlace[ExactPosterior],
    cohort_posteriors: ByExperiment[CohortPosterior],
    noise: CohortNoise | None,
    tables: ByName[PlainTable],
    tables_of_experiments: ByExperiment[ByName[PlainTable]],
    comparison_csv: ComparisonTable,
    statements_csv: StatementsTable,
    population_cohorts: ByExperiment[CohortTable],
    population_strata: ByExperiment[StrataTable],
    validation: RoundsTable | None,
    pngs: tuple[Path, ...],
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

    ``tables`` are those of the whole study; ``pngs`` lie in a folder beside that page. ``artefacts`` are all
    files of the study. Inputs of experiments that are not run are empty.
    """
    page, title, of_study = pngs[0].parents[1] / f"{LANDING}.html", cohort_title, dict(tables)
    experiments = tuple(
        _experiment(name, settings, verdicts, exact_posteriors, noise, of_study, tables_of_experiments[name])
        for name, settings in experiments_shown.items()
    )
    main = next(each for each in experiments if each.name == main_experiment)
    results = Results(observations, experiments, main, comparison_csv, statements_csv)
    populations = _populations(populations_shown, population_cohorts, population_strata, of_study)
    on_speeds = [each for each in experiments if each.exact]
    drawn = (cohort_posteriors, pngs, page, title)
    written = as_yaml(configuration)
    whole = {
        "cohort": cohort_in_words(recording, title),
        "landing": make_landing(results, title, [relative(path, page) for path in artefacts]),
        "tables": study_tables(results, title),
        "figures": study_figures(pngs, list(experiments_shown), page, main.name, title),
        "experiments": list(experiments_shown),
        "main": make_section(main, {}, title),
        "sections": [make_section(each, *_beside(each.name, "speeds", *drawn)) for each in on_speeds],
        "populations": [
            make_population_section(each, *_beside(each.name, "population", *drawn)) for each in populations
        ],
        "validation": None if validation is None else shown_validation(validation),
        "files": file_groups(artefacts, page),
        "provenance": {
            "seed": seed,
            "code_hash": code,
            "version": __version__,
            "artefacts": provenance_table(artefacts),
            "software": software_table(),
            "configuration": written,
            "configuration_file": CONFIGURATION,
        },
    }
    return Pages(render(whole), {name: render(whole, name) for name in FURTHER}, written)


def _beside(
    experiment: str,
    scope: Scope,
    cohorts: Mapping[str, CohortPosterior],
    pngs: Sequence[Path],
    page: Path,
    title: str,
) -> tuple[dict[str, Figure], str, CohortSection | None]:
    """Return what a section is made with beside its experiment: figures, what subjects are, their cohort."""
    cohort = cohort_section(cohorts[experiment], title) if experiment in cohorts else None
    return section_figures(scope, pngs, experiment, page, title), title, cohort


def cohort_in_words(recording: Path, title: str) -> Cohort:
    """Return what the cohort says of its own recordings; only ``origin`` is required."""
    file = read_recording_file(recording.parent)
    if not file.origin:
        raise ArtefactError(f"{recording}: add `origin`: who or what was recorded, in a few words")
    said = file.protocol.model_dump(exclude_unset=True).items()
    protocol = tuple(protocol_entry(key, value) for key, value in said)
    return Cohort(title, recording.parent.as_posix(), file.origin, protocol)


def _experiment(
    name: str,
    settings: Mapping[str, JsonValue],
    verdicts: ByPlace[Verdict],
    posteriors: ByPlace[ExactPosterior],
    noise: CohortNoise | None,
    of_study: Mapping[str, pd.DataFrame],
    own: Mapping[str, pd.DataFrame],
) -> Experiment:
    """Return what there is of an experiment; ``own`` are the tables in its folder."""
    of_speeds: dict[str, Any] = {}
    if "exact" in settings:
        of_speeds = {kind: own[kind] for kind in ("calibration", "alarms", "identifiability")}
        of_speeds |= {"results": _of_experiment(posteriors, name), "noise": noise}
    return Experiment(
        name=name,
        settings=settings,
        verdicts=_of_experiment(verdicts, name),
        scores=_rows(of_study["ppc"], name),
        features=_rows(of_study["features"], name),
        posterior=_rows(of_study["posterior"], name),
        truth=_rows(of_study["truth"], name) if "truth" in of_study else no_rows(),
        recovery=own["recovery"],
        recovery_acquisition=own["recovery_acquisition"],
        training=own["training"],
        **of_speeds,
    )


def _populations(
    sections: Sections,
    cohorts: Mapping[str, pd.DataFrame],
    strata: Mapping[str, pd.DataFrame],
    of_study: Mapping[str, pd.DataFrame],
) -> Iterator[PopulationSection]:
    """Yield the experiments over a population, in the order of their sections."""
    for name, plain in sections.items():
        pressures = _rows(of_study["pressures"], name) if "pressures" in of_study else no_rows()
        own = pressures if len(pressures) else None
        mass = float(str(plain["interval"]))
        yield PopulationSection(name, plain, mass, cohorts[name], strata[name], own)


def _of_experiment(files: ByPlace[Item], experiment: str) -> dict[str, Item]:
    """Return what there is of each subject in an experiment; nothing else is read."""
    return {place.subject: files[place] for place in files if place.experiment == experiment}


def _rows(table: pd.DataFrame, experiment: str) -> pd.DataFrame:
    return table[table["experiment"] == experiment]
