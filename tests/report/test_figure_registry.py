"""The list of figures: complete without matplotlib, and every figure of it stands on the page."""

from __future__ import annotations

import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest
from report_case import make_experiment

from swesbi.artefacts import ArtefactError
from swesbi.report.figures.registry import FIGURES, FigureSpec
from swesbi.report.page.figures import PAGE_FIGURES, PageFigure, PagePart, figures_of, further_figures
from swesbi.report.page.names import FURTHER
from swesbi.report.page.page import study_figures

TEMPLATE = "".join(
    (files("swesbi.report.page") / "templates" / f"{name}.html").read_text(encoding="utf-8")
    for name in FURTHER
)
FIELDS = {"predictive": 90.0, "credible": 90.0, "excluded": "Outside: F."}
SOURCES = {
    PagePart.STUDY: "page.figures.study",
    PagePart.EXPERIMENT: "page.figures",
    PagePart.SPEEDS: "section.figures",
    PagePart.POPULATION: "section.figures",
}


def test_the_list_is_read_without_matplotlib() -> None:
    modules = "swesbi.report.figures.registry, swesbi.report.page.figures"
    code = f"import sys, {modules}; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_every_figure_of_the_workflow_but_those_of_a_subject_is_on_the_page() -> None:
    shown = {name for part in PagePart for name in figures_of(part)}
    assert {figure.name for figure in FIGURES if figure.of != "subject"} == shown - {"noise"}


@pytest.mark.parametrize("spec", PAGE_FIGURES, ids=lambda spec: f"{spec.name}, {spec.part}")
def test_a_figure_says_what_it_shows_and_stands_on_the_page(spec: PageFigure) -> None:
    description, caption = spec.texts("virtual volunteers", "some", FIELDS)
    assert "{" not in description + caption
    assert "virtual volunteers" in caption or "population of some" in caption
    assert f"{SOURCES[spec.part]}.{spec.name}" in TEMPLATE


def test_a_figure_of_the_cohort_needs_no_entry_of_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    spec = FigureSpec("new_figure", "new", "cohort", "a new figure", "What is new ({cohort}).")
    monkeypatch.setattr("swesbi.report.page.figures.FIGURES", (*FIGURES, spec))
    assert "new" in further_figures()
    assert [*figures_of(PagePart.STUDY)][-1] == "new"
    texts = figures_of(PagePart.STUDY)["new"].texts("virtual volunteers", "some", FIELDS)
    assert texts == ("What is new", "What is new (virtual volunteers).")
    assert "page.figures.further" in TEMPLATE


def test_a_figure_of_the_study_that_is_not_given_is_named(tmp_path: Path) -> None:
    with pytest.raises(ArtefactError, match=r"posterior, ppc, workflow missing"):
        study_figures([], [], tmp_path / "index.html", make_experiment("paper", {"A": True}), "volunteers")
