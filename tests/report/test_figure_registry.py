"""The list of figures: complete without matplotlib, and every figure of it stands on the page."""

from __future__ import annotations

import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest
from PIL import Image
from rules import STAGES

from swesbi.artefacts import ArtefactError
from swesbi.report.figures import registry
from swesbi.report.figures.registry import FIGURES, ON_PAGE, FigureSpec, on_page
from swesbi.report.page.names import FURTHER
from swesbi.report.page.page import study_figures

TEMPLATE = "".join(
    (files("swesbi.report.page") / "templates" / f"{name}.html").read_text(encoding="utf-8")
    for name in FURTHER
)
SOURCES = {"cohort": "page.figures.study", "experiment": "page.figures"}
KINDS = [(scope, name) for scope in ON_PAGE for name in on_page(scope)]


def test_the_list_is_read_without_matplotlib() -> None:
    code = f"import sys, {registry.__name__}; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_every_figure_but_those_of_a_subject_is_on_the_page_and_drawn_by_a_rule() -> None:
    shown = {figure.name for scope in ON_PAGE for figure in on_page(scope).values()}
    assert {figure.name for figure in FIGURES if figure.of != "subject"} == shown
    assert {figure.rule for figure in FIGURES} <= set(STAGES)


@pytest.mark.parametrize("spec", FIGURES, ids=lambda spec: f"{spec.name}, {spec.of}, {spec.rule}")
def test_a_figure_says_what_it_shows_and_of_whom(spec: FigureSpec) -> None:
    description, caption = spec.texts("virtual volunteers", "amortised", "S-07")
    assert description != caption
    assert "virtual volunteers" in caption or "amortised" in caption
    assert ("S-07" in caption) == (spec.of == "subject")


@pytest.mark.parametrize(("scope", "name"), KINDS)
def test_a_figure_stands_on_the_page(scope: registry.Scope, name: str) -> None:
    assert f"{SOURCES.get(scope, 'section.figures')}.{name}" in TEMPLATE


def test_a_new_figure_of_the_cohort_stands_beside_the_others(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    spec = FigureSpec("new_figure", "new", "cohort", "a new figure", "What is new ({cohort}).", "New")
    monkeypatch.setattr(registry, "FIGURES", (*FIGURES, spec))
    pngs = [tmp_path / f"{name}.png" for name in ("workflow", "ppc", "posterior", "new")]
    for png in pngs:
        Image.new("L", (3, 2)).save(png)
    found = study_figures(pngs, [], tmp_path / "index.html", "paper", "virtual volunteers")
    assert [figure.caption for figure in found.further] == ["What is new (virtual volunteers)."]
    assert "page.figures.further" in TEMPLATE


def test_a_figure_of_the_study_that_is_not_given_is_named(tmp_path: Path) -> None:
    with pytest.raises(ArtefactError, match="figures of the study: .*ppc.* missing"):
        study_figures([], [], tmp_path / "index.html", "paper", "volunteers")
