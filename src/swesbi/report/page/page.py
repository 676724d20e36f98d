"""The page itself: what the templates are given, and their rendering."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import yaml
from jinja2 import DictLoader, Environment, StrictUndefined

from swesbi.artefacts import ArtefactError
from swesbi.report.figures.registry import on_page
from swesbi.report.numbers import with_symbols
from swesbi.report.page.files import Figure
from swesbi.report.page.forest import svg_symbols
from swesbi.report.page.landing import Landing
from swesbi.report.page.names import LANDING
from swesbi.report.page.sections import Section, section_figures
from swesbi.report.results import Results
from swesbi.report.table import Table
from swesbi.report.tables import subjects
from swesbi.report.tables.experiments import (
    comparison_table,
    differences_table,
    paper_table,
    recovery_table,
    statements_table,
    training_table,
)
from swesbi.report.tables.validation import StoredValidation

TEMPLATES: Final = (
    "templates/index.html", "templates/method.html", "templates/checks.html", "templates/paper.html",
    "templates/files.html", "templates/layout.html", "templates/validation.html", "templates/macros.html",
    "templates/page.css", "templates/page.js",
)  # fmt: skip
PLACED: Final = ("workflow", "ppc", "posterior")
"""Figures of the study that have a place of their own in a template."""
ABOVE: Final = "../"
"""Before every path of a page in the folder ``report``: paths are relative to the landing page."""


@dataclass(frozen=True)
class Cohort:
    """What the subjects are, and who says so.

    Attributes:
        title: What figures and tables call them.
        folder: Folder of the recordings.
        origin: Where the recordings come from, in the words of the cohort's ``recording.yaml``.
        protocol: How they were made, likewise, entry by entry; empty if it does not say.
    """

    title: str
    folder: str
    origin: str
    protocol: tuple[str, ...]

    @property
    def origin_after_title(self) -> str:
        """The origin as it follows the title, which it may begin with."""
        return self.origin.removeprefix(self.title).lstrip(" ,;") or self.origin


@dataclass(frozen=True)
class Figures:
    """The figures of the page: of the study by name, those without a place of their own, one a training."""

    study: Mapping[str, Figure]
    further: tuple[Figure, ...]
    training: tuple[Figure, ...]


@dataclass(frozen=True)
class PageProvenance:
    """Where the results come from; the configuration as text, and the file that holds the same."""

    seed: int
    code_hash: str
    version: str
    artefacts: Table
    software: Table
    configuration: str
    configuration_file: str


@dataclass(frozen=True)
class Page:
    """Everything that the templates show: the main experiment, those on speeds, those over a population.

    Attributes:
        cohort: What the subjects are.
        landing: What only the landing page shows.
        tables: Tables of the whole study by name.
        figures: Its figures.
        experiments: Names of all experiments that have verdicts.
        main: The experiment that stands for the paper's.
        sections: Of the experiments on speeds.
        populations: Of those over a population.
        validation: What came out of the validation; None where there is no table of it.
        files: Every file, a table a folder.
        provenance: Where the results come from.
    """

    cohort: Cohort
    landing: Landing
    tables: Mapping[str, Table]
    figures: Figures
    experiments: Sequence[str]
    main: Section
    sections: Sequence[Section]
    populations: Sequence[Section]
    validation: StoredValidation | None
    files: Sequence[Table]
    provenance: PageProvenance


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
) -> Figures:
    """Return the figures of the study, and each experiment's training.

    Args:
        pngs: PNG of each, its PDF beside it; others are left out.
        experiments: Names of those whose training is shown.
        page: The page.
        main: Name of the main experiment.
        title: What the subjects are.

    Raises:
        ArtefactError: A file is no PNG, or a figure is missing.
    """
    shown = section_figures("cohort", pngs, main, page, title)
    trained = {name: section_figures("experiment", pngs, name, page, title) for name in experiments}
    missing = [name for name in on_page("cohort") if name not in shown]
    missing += [f"training of {name}" for name, found in trained.items() if not found]
    if missing:
        raise ArtefactError(f"figures of the study: {', '.join(missing)} missing")
    return Figures(
        shown,
        tuple(shown[name] for name in on_page("cohort") if name not in PLACED),
        tuple(found["training"] for found in trained.values()),
    )


def render(page: Page, name: str = LANDING) -> str:
    """Return one of the pages as HTML; equal pages give equal text.

    Args:
        page: What the pages show.
        name: ``LANDING`` or one of ``FURTHER``.
    """
    root = "" if name == LANDING else ABOVE
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
