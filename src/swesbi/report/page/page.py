"""The page itself: what the templates are given, and their rendering."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import yaml
from jinja2 import DictLoader, Environment, StrictUndefined

from swesbi.artefacts import ArtefactError
from swesbi.report.numbers import with_symbols
from swesbi.report.page.figures import PagePart, figures_of, further_figures
from swesbi.report.page.files import Figure, figure
from swesbi.report.page.forest import svg_symbols
from swesbi.report.page.landing import Landing
from swesbi.report.page.names import LANDING
from swesbi.report.page.sections import (
    Facts,
    Section,
    caution,
    headline,
    verdicts_in_words,
)
from swesbi.report.results import Experiment, Results
from swesbi.report.table import Table
from swesbi.report.tables import subjects
from swesbi.report.tables.experiments import (
    comparison_table,
    differences_table,
    median_table,
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
    """Everything that the templates show; a section is of one experiment on speeds or over a population."""

    results: Results
    landing: Landing
    cohort: Cohort
    figures: Figures
    sections: Sequence[Section]
    populations: Sequence[Section]
    validation: StoredValidation | None
    files: Sequence[Table]
    provenance: PageProvenance

    @cached_property
    def verdicts(self) -> Facts:
        """Verdict of each subject in the main experiment, as a sentence."""
        return verdicts_in_words(self.results.main.verdicts)

    @cached_property
    def facts(self) -> Facts:
        """What came out of the main experiment."""
        return headline(self.results.main)

    @cached_property
    def caution(self) -> str:
        """A warning where its credible intervals cover less than they claim."""
        return caution(self.results.main)

    @cached_property
    def tables(self) -> Mapping[str, Table]:
        """Tables of the main experiment, and of all beside each other, by name."""
        return _tables(self.results, self.cohort.title)


def study_figures(
    files: Sequence[Path],
    trainings: Sequence[Path],
    page: Path,
    main: Experiment,
    title: str,
) -> Figures:
    """Put captions to the figures of the study, and to each experiment's training.

    Args:
        files: PNG of each figure of the study, named as the figure, its PDF beside it.
        trainings: PNG of each experiment's training.
        page: The page.
        main: The main experiment.
        title: What the subjects are.

    Raises:
        ArtefactError: A file is no PNG, a figure is missing, or the page knows no figure of a file's name.
    """
    out = [subject for subject, verdict in main.verdicts.items() if not verdict.may_be_read]
    fields = {
        "predictive": main.predictive_percent,
        "credible": main.credible_percent,
        "excluded": f"Outside the prior's support, and greyed: {', '.join(out)}." if out else "",
    }
    specs, trained = figures_of(PagePart.STUDY), figures_of(PagePart.EXPERIMENT)["training"]
    by_name = {png.stem: png for png in files}
    if differing := sorted(specs.keys() ^ by_name.keys()):
        raise ArtefactError(f"figures of the study: {', '.join(differing)} missing, or unknown to the page")
    shown = {
        name: figure(png, page, *specs[name].texts(title, main.name, fields), png.with_suffix(".pdf"))
        for name, png in by_name.items()
    }
    training = tuple(
        figure(png, page, *trained.texts(title, png.stem.removeprefix(f"{trained.name}-")))
        for png in trainings
    )
    return Figures(shown, tuple(shown[name] for name in further_figures()), training)


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


def _tables(results: Results, title: str) -> dict[str, Table]:
    main, experiments = results.main, results.experiments
    others = [experiment for experiment in experiments if experiment is not main]
    return {
        "context": subjects.context_table(results.observations, title),
        "recordings": subjects.recording_table(results.observations, title),
        "verdicts": subjects.verdict_table(main, title),
        "scores": subjects.score_table(main, title),
        "features": subjects.feature_table(main, title),
        "posterior": subjects.posterior_table(main, title),
        "derived": subjects.derived_table(main, title),
        "differences": differences_table(others, main),
        "experiments": comparison_table(experiments, title),
        "medians": median_table(experiments, title),
        "recovery": recovery_table(experiments),
        "training": training_table(experiments),
        "paper": paper_table(results.comparison, title),
        "statements": statements_table(results.statements, title),
    }
