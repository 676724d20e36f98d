"""The pages of a study, readable without the workflow, from all that it made."""

from __future__ import annotations

import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

import pandas as pd
import yaml
from jinja2 import DictLoader, Environment, StrictUndefined
from pydantic import JsonValue

from swesbi import __version__
from swesbi.artefacts import ArtefactError
from swesbi.artefacts.csv import PlainTable
from swesbi.artefacts.files import hdf5_provenance
from swesbi.artefacts.typed import ByExperiment, ByName, ByPlace, Text, Texts
from swesbi.checks.calibration.table import StrataTable
from swesbi.persons.cohort.stored import CohortPosterior
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.cohort.recording_file import read_recording_file
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.report.figures.registry import Scope, on_page
from swesbi.report.numbers import protocol_entry, svg_symbols, with_symbols
from swesbi.report.page.landing import make_landing
from swesbi.report.page.names import FURTHER, LANDING
from swesbi.report.page.sections import (
    Figure,
    make_population_section,
    make_section,
    relative,
    section_figures,
)
from swesbi.report.paper.comparison import ComparisonTable, StatementsTable
from swesbi.report.results import Experiment, Results, no_rows
from swesbi.report.table import Link, Table
from swesbi.report.tables import subjects
from swesbi.report.tables.cohort_posterior import CohortSection, cohort_section
from swesbi.report.tables.experiments import (
    comparison_table,
    differences_table,
    paper_table,
    recovery_table,
    statements_table,
    training_table,
)
from swesbi.report.tables.population import PopulationSection
from swesbi.report.tables.validation import RoundsTable, shown_validation
from swesbi.verdict.summary import CohortTable
from swesbi.verdict.verdict import Verdict

Sections = dict[str, dict[str, JsonValue]]
"""Sections of the configuration, by experiment."""
CONFIGURATION: Final = "configuration.yaml"
Item = TypeVar("Item")
TEMPLATES: Final = (
    "templates/index.html", "templates/method.html", "templates/checks.html", "templates/paper.html",
    "templates/files.html", "templates/layout.html", "templates/validation.html", "templates/macros.html",
    "templates/page.css", "templates/page.js",
)  # fmt: skip
PLACED: Final = ("workflow", "ppc", "posterior")
"""Figures of the study that have a place of their own in a template."""
HERE: Final = "."
WHOLE_COHORT: Final = "whole cohort"
MEANING: Final = {
    HERE: "beside this page.",
    "tables": "every table of the study, as CSV, and table 1 as LaTeX.",
    "figures": "figures of the cohort, as PDF and PNG.",
    "cohort": "noise of the speeds; observed curve with errors and rejected samples; passive baseline.",
    "cmaes": "reference fits by CMA-ES: history of every seed, best fit.",
    "simulations": "simulations from each prior, in shards.",
}
EXPERIMENT_MEANING: Final = (
    "training set, network and losses of the experiment; verdict, posterior, predictive check and figures "
    "of each subject."
)
SOFTWARE: Final = (
    "numpy", "scipy", "numba", "torch", "sbi", "cma", "pandas", "h5py", "xarray", "matplotlib",
    "snakemake",
)  # fmt: skip


@dataclass(frozen=True)
class Cohort:
    """What the subjects are, and who says so: origin and protocol in the words of its ``recording.yaml``."""

    title: str
    folder: str
    origin: str
    protocol: tuple[str, ...]

    @property
    def origin_after_title(self) -> str:
        """The origin as it follows the title, which it may begin with."""
        return self.origin.removeprefix(self.title).lstrip(" ,;") or self.origin


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


def study_tables(results: Results, title: str) -> Mapping[str, Table]:
    """Return the tables of the whole study by name: subjects, experiments beside each other, the paper."""
    main, experiments = results.main, results.experiments
    return {
        "context": subjects.context_table(results.observations, title),
        "recordings": subjects.recording_table(results.observations, title),
        "posterior": subjects.posterior_table(experiments, title),
        "differences": differences_table([each for each in experiments if each is not main], main),
        "experiments": comparison_table(experiments, title),
        "recovery": recovery_table(experiments),
        "training": training_table(experiments),
        "paper": paper_table(results.comparison, title),
        "statements": statements_table(results.statements, title),
    }


def study_figures(
    pngs: Sequence[Path], experiments: Sequence[str], page: Path, main: str, title: str
) -> dict[str, Any]:
    """Return figures of the study by name, those without a place in a template, and one a training."""
    shown = section_figures("cohort", pngs, main, page, title)
    trained = {name: section_figures("experiment", pngs, name, page, title) for name in experiments}
    missing = [name for name in on_page("cohort") if name not in shown]
    missing += [f"training of {name}" for name, found in trained.items() if not found]
    if missing:
        raise ArtefactError(f"figures of the study: {', '.join(missing)} missing")
    return {
        "study": shown,
        "further": [shown[name] for name in on_page("cohort") if name not in PLACED],
        "training": [found["training"] for found in trained.values()],
    }


def render(page: Mapping[str, object], name: str = LANDING) -> str:
    """Return ``LANDING`` or one of ``FURTHER`` as HTML, from all that templates show."""
    # paths are relative to the landing page, and the others lie in a folder beside it
    root = "" if name == LANDING else "../"
    return templates().get_template(f"{name}.html").render(page=page, here=name, root=root)


def templates() -> Environment:
    """Return the page's templates by name; what one shows and is not given is an error."""
    folder = Path(__file__).parent
    sources = {Path(name).name: (folder / name).read_text(encoding="utf-8") for name in TEMPLATES}
    environment = Environment(
        loader=DictLoader(sources),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["symbols"] = with_symbols
    environment.filters["svg_symbols"] = svg_symbols
    return environment


def as_yaml(plain: Mapping[str, Any]) -> str:
    """Return a configuration as the page prints it."""
    return yaml.safe_dump(dict(plain), allow_unicode=True, default_flow_style=None, sort_keys=True, width=100)


def file_groups(paths: Sequence[Path], page: Path) -> tuple[Table, ...]:
    """Group the files by the folder that they lie in, in the order given; one row a subject or kind.

    Examples: ``paper/subjects/A/ppc.png`` is ppc.png of A, ``cmaes/A.h5`` is A.h5 of the whole cohort.
    """
    grouped: dict[str, dict[str, list[Link]]] = {}
    for path in dict.fromkeys(paths):
        href = relative(path, page)
        folder, *within, name = Path(href).parts if "/" in href else (HERE, href)
        row = ", ".join(part for part in within if part != "subjects") or WHOLE_COHORT
        grouped.setdefault(folder, {}).setdefault(row, []).append(Link(name, href))
    return tuple(
        Table(
            f"{folder}/: {MEANING.get(folder, EXPERIMENT_MEANING)}",
            pd.DataFrame({"Of": list(rows), "Files": [tuple(links) for links in rows.values()]}),
        )
        for folder, rows in grouped.items()
    )


def provenance_table(paths: Sequence[Path]) -> Table:
    """Return seed and code of every kind of HDF5 artefact among these files."""
    found = [hdf5_provenance(path) for path in paths if path.suffix == ".h5"]
    named = {"Seed": "seed", "Code hash": "code_hash", "swesbi": "package_version"}
    rows = [
        {"Artefact": kind, "Files": len(each)}
        | {head: ", ".join(sorted({str(getattr(one, name)) for one in each})) for head, name in named.items()}
        for kind in sorted({one.kind for one in found})
        for each in [[one for one in found if one.kind == kind]]
    ]
    return Table(
        "What made the artefacts.",
        pd.DataFrame(rows),
        note="The code hash names the code of the stage that wrote the file, docstrings and comments left "
        "out.",
    )


def software_table() -> Table:
    """Return the versions of what the results depend on."""
    versions = {"Python": platform.python_version()} | {name: version(name) for name in SOFTWARE}
    frame = pd.DataFrame({"Package": list(versions), "Version": list(versions.values())})
    return Table("Versions of the packages behind this run.", frame)
