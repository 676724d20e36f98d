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
from swesbi.report.page.forest import svg_symbols
from swesbi.report.page.names import LANDING
from swesbi.report.page.sections import section_figures
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

TEMPLATES: Final = (
    "templates/index.html", "templates/method.html", "templates/checks.html", "templates/paper.html",
    "templates/files.html", "templates/layout.html", "templates/validation.html", "templates/macros.html",
    "templates/page.css", "templates/page.js",
)  # fmt: skip
PLACED: Final = ("workflow", "ppc", "posterior")
"""Figures of the study that have a place of their own in a template."""


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
