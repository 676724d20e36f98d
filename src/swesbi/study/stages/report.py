"""The landing page of the results, readable without the workflow."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import JsonValue

from swesbi import __version__
from swesbi.artefacts import Origin, atomic_path
from swesbi.base.settings import Settings
from swesbi.report.page.figures import PagePart
from swesbi.report.page.files import file_groups, provenance_table, relative, software_table
from swesbi.report.page.landing import make_landing
from swesbi.report.page.page import Page, PageProvenance, as_yaml, render, study_figures
from swesbi.report.page.sections import (
    Section,
    make_population_section,
    make_section,
    section_figures,
)
from swesbi.report.results import Results
from swesbi.report.tables.cohort_posterior import CohortSection, cohort_sections
from swesbi.report.tables.exact import Exact
from swesbi.report.tables.population import OverPopulation
from swesbi.report.tables.validation import stored_validation
from swesbi.study.stages.report_inputs import read_cohort_words, read_exact, read_populations, read_results


class ReportSettings(Settings):
    """What the page prints of the study's configuration.

    Attributes:
        cohort_title: What the subjects are called.
        main_experiment: The experiment of figures 2 and 3 and of table 1.
        experiments: Section of each experiment shown, its prior as the prior itself.
        populations: Section of each experiment over a population, with the mass of its credible intervals.
        configuration: The configuration as the page prints it.
    """

    cohort_title: str
    main_experiment: str
    experiments: dict[str, dict[str, JsonValue]]
    populations: dict[str, dict[str, JsonValue]]
    configuration: dict[str, JsonValue]


@dataclass(frozen=True)
class ReportFiles:
    """What the pages are made of, and what is written; lists of experiments that are not run are empty.

    Attributes:
        recording: The cohort's ``recording.yaml``.
        observations: Observed curves of all subjects.
        verdicts: Verdicts of every subject in every experiment.
        trainings: Losses of every network.
        recoveries: ``recovery.csv`` of every experiment.
        recovery_acquisitions: The same under acquisition noise.
        ppc_csv: Scores of every subject.
        features_csv: Features of every subject.
        posterior_csv: Posteriors of every subject.
        comparison_csv: What the paper prints beside this study.
        statements_csv: The paper's statements beside this study.
        study_pngs: Figures of the study.
        training_pngs: Figures of the trainings.
        exact_posteriors: ``posterior.h5`` of experiments on speeds, as what follows is.
        calibrations: ``calibration.csv``.
        alarms: ``alarms.csv``.
        identifiabilities: ``identifiability.csv``.
        noise: The cohort's noise; one file or none.
        truth_csv: ``truth.csv``; one file or none.
        exact_pngs: Their figures.
        population_cohorts: ``cohort.csv`` of experiments over a population, as what follows is.
        population_strata: ``strata.csv``.
        population_pngs: Their figures.
        pressures_csv: ``pressures.csv``; one file or none.
        cohort_posteriors: ``cohort_posterior.h5``.
        validations: Stored table of the validation; one file or none.
        artefacts: All files of the study, to which the page links.
        report: Output, the landing page.
        pages: Outputs, the further pages in a folder beside it.
        configuration: Output, the configuration.
    """

    recording: Path
    observations: Sequence[Path]
    verdicts: Sequence[Path]
    trainings: Sequence[Path]
    recoveries: Sequence[Path]
    recovery_acquisitions: Sequence[Path]
    ppc_csv: Path
    features_csv: Path
    posterior_csv: Path
    comparison_csv: Path
    statements_csv: Path
    study_pngs: Sequence[Path]
    training_pngs: Sequence[Path]
    exact_posteriors: Sequence[Path]
    calibrations: Sequence[Path]
    alarms: Sequence[Path]
    identifiabilities: Sequence[Path]
    noise: Sequence[Path]
    truth_csv: Sequence[Path]
    exact_pngs: Sequence[Path]
    population_cohorts: Sequence[Path]
    population_strata: Sequence[Path]
    population_pngs: Sequence[Path]
    pressures_csv: Sequence[Path]
    cohort_posteriors: Sequence[Path]
    validations: Sequence[Path]
    artefacts: Sequence[Path]
    report: Path
    pages: Sequence[Path]
    configuration: Path


def report(*, files: ReportFiles, settings: ReportSettings, origin: Origin) -> None:
    """Write the configuration and the pages, which refer to every file by its path relative to themselves.

    None is written before all have their text.

    Raises:
        ArtefactError: An input is missing for an experiment, or cannot be read.
    """
    title, report = settings.cohort_title, files.report
    results, exact = _numbers(files, settings)
    figures = study_figures(files.study_pngs, files.training_pngs, report, results.main, title)
    cohorts = cohort_sections(files.cohort_posteriors, title)
    sections = _sections(exact, files.exact_pngs, report, title, cohorts)
    populations = _populations(files, settings.populations, title, cohorts)
    origins = _provenance(settings, origin, files.artefacts, relative(files.configuration, report))
    validation = next(map(stored_validation, files.validations), None)
    links = [relative(path, report) for path in files.artefacts]
    landing = make_landing(results, exact, title, links)
    cohort, shown = read_cohort_words(files.recording, title), file_groups(files.artefacts, report)
    page = Page(results, landing, cohort, figures, sections, populations, validation, shown, origins)
    texts = {report: render(page), **{path: render(page, path.stem) for path in files.pages}}
    for path, text in {files.configuration: origins.configuration, **texts}.items():
        _write(path, text)


def _numbers(files: ReportFiles, settings: ReportSettings) -> tuple[Results, tuple[Exact, ...]]:
    """Read what all experiments have, and what only those on speeds have."""
    tables = {"scores": files.ppc_csv, "features": files.features_csv, "posterior": files.posterior_csv}
    by_experiment = {
        "training": files.trainings,
        "own": files.recoveries,
        "acquisition": files.recovery_acquisitions,
    }
    results = read_results(
        settings.experiments, settings.main_experiment, files.observations, files.verdicts, tables,
        by_experiment, (files.comparison_csv, files.statements_csv),
    )  # fmt: skip
    checks = {
        "calibration": files.calibrations,
        "alarms": files.alarms,
        "identifiability": files.identifiabilities,
    }
    experiments, posteriors = results.experiments, files.exact_posteriors
    return results, read_exact(experiments, posteriors, checks, files.noise, files.truth_csv)


def _populations(
    files: ReportFiles,
    sections: Mapping[str, Mapping[str, JsonValue]],
    title: str,
    cohorts: Mapping[str, CohortSection],
) -> list[Section]:
    read = read_populations(sections, files.population_cohorts, files.population_strata, files.pressures_csv)
    return [_population(each, files.population_pngs, files.report, title, cohorts) for each in read]


def _population(
    each: OverPopulation, pngs: Sequence[Path], report: Path, title: str, cohorts: Mapping[str, CohortSection]
) -> Section:
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
