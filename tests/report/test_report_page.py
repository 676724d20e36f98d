from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from importlib.resources import files
from pathlib import Path

import pandas as pd
import pytest
from comparison_case import observation
from matplotlib.figure import Figure as Drawing
from PIL import Image
from report_case import make_experiment
from rules import STAGES

from swesbi.artefacts import ArtefactError
from swesbi.parameters import THETA_NAMES
from swesbi.report.columns import _BY_SOURCE, _OF_SEVERAL
from swesbi.report.figures import registry
from swesbi.report.figures.registry import FIGURES, ON_PAGE, FigureSpec, on_page
from swesbi.report.figures.style import save_figure
from swesbi.report.numbers import estimate, fixed, mean_sd, percent, significant, span, with_symbols
from swesbi.report.page.landing import LEFT, level_kept, make_landing, panel
from swesbi.report.page.names import FURTHER
from swesbi.report.page.sections import caution, figure
from swesbi.report.page.study import study_figures
from swesbi.report.paper.comparison import COMPARISON
from swesbi.report.results import Results
from swesbi.report.table import MUTED, Column, words
from swesbi.report.tables.experiments import (
    comparison_table,
    differences_table,
    paper_table,
    recovery_table,
    training_table,
)
from swesbi.report.tables.subjects import (
    beside_the_measured,
    derived_table,
    feature_table,
    posterior_table,
    score_table,
    verdict_table,
)

TITLE = "virtual volunteers"
TEMPLATE = "".join(
    (files("swesbi.report.page") / "templates" / f"{name}.html").read_text(encoding="utf-8")
    for name in FURTHER
)
SOURCES = {"cohort": "page.figures.study", "experiment": "page.figures"}
KINDS = [(scope, name) for scope in ON_PAGE for name in on_page(scope)]
NAN = math.nan


@pytest.mark.parametrize(
    ("form", "given", "text"),
    [
        (significant, (0.012345,), "0.0123"),
        (significant, (9.996,), "10.0"),
        (significant, (-154.67,), "−155"),
        (significant, (120000.0,), "120,000"),
        (significant, (0.0,), "0"),
        (significant, (NAN,), "–"),
        (significant, (math.inf,), "inf"),
        (fixed, (-0.8432, 2), "−0.84"),
        (fixed, (-0.001, 2), "0.00"),
        (percent, (0.905,), "90.5"),
        (span, ("–", "–"), "–"),
        (fixed, (NAN, 1), "–"),
        (mean_sd, ([1.0, 2.0, 4.0], 2), "2.33 ± 1.53"),
        (mean_sd, ([1.25], 2), "1.25"),
        (mean_sd, ([], 2), "–"),
        (estimate, (53.66, 53.52, 53.83), ("53.66", "53.52 to 53.83")),
        (estimate, (40.0, 16.4, 69.6), ("40.0", "16.4 to 69.6")),
        (estimate, (2.0, 2.0, 2.0), ("2.00", "2.00 to 2.00")),
        (partial(estimate, derived="mL"), (113.97, 113.9678, 113.9745), ("114", "114 to 114")),
        (estimate, (NAN, NAN, NAN), ("–", "–")),
    ],
)
def test_numbers_have_the_digits_that_tell_something_and_a_true_minus(
    form: Callable[..., object], given: tuple[object, ...], text: object
) -> None:
    assert form(*given) == text


def test_a_predicted_quantity_beside_the_measured_says_so_in_words() -> None:
    row = {"median": 0.724, "low": 0.690, "high": 0.743}
    said = [beside_the_measured(row | {"measured": measured}) for measured in (0.619, 0.8, 0.7, NAN)]
    assert said == ["predicted above measured", "predicted below measured", "holds the measured", "–"]


def test_a_column_of_several_values_is_an_interval_or_a_value_with_its_own() -> None:
    row = {"value": 0.905, "low": 0.88, "high": 0.92, "none": NAN}
    assert Column("value", "Coverage", "%", "0%").cell(row) == "90"
    assert Column(("low", "high"), "Interval", "", "2f").cell(row) == "0.88 to 0.92"
    assert Column(("value", "low", "high"), "Coverage", "%", "1%").cell(row) == "90.5 (88.0 to 92.0)"
    assert Column(("none", "none", "none"), "Coverage", "%", "1%").cell(row) == "–"
    column = words("sampler", "Answer", {"mcmc": "MCMC", "": "–"})
    shown = [column.cell({"sampler": name}) for name in ("mcmc", "", "other", None)]
    assert shown == ["MCMC", "–", "other", "–"]


def test_no_column_is_defined_twice() -> None:
    assert len({column.source for column in _BY_SOURCE}) == len(_BY_SOURCE)
    assert {str(column.source) for column in _BY_SOURCE}.isdisjoint(_OF_SEVERAL)


def test_a_figure_knows_its_size_and_its_pdf(tmp_path: Path) -> None:
    png, pdf = tmp_path / "figures" / "ppc.png", tmp_path / "figures" / "ppc.pdf"
    save_figure(Drawing(figsize=(2.0, 1.0)), png, pdf)
    shown = figure(png, tmp_path / "index.html", "what", "caption", pdf)
    assert (shown.source, shown.full) == ("figures/ppc.png", "figures/ppc.pdf")
    assert (shown.width, shown.height) == (600, 300)
    with pytest.raises(ArtefactError, match="is not a PNG"):
        figure(pdf, tmp_path / "index.html", "what", "caption")


def test_the_comparison_is_shown_as_written_and_escaped(tmp_path: Path) -> None:
    path = tmp_path / "paper_comparison.csv"
    path.write_text(
        'quantity,paper,this_study,note,origin\n"r(k_0, k_ATP)",-0.84 +- 0.15,-0.80,<b>near</b>,found\n'
        "D,6,6,the same,designed (there)\n"
    )
    first, second = (row.cells for row in paper_table(COMPARISON.read(path), TITLE).rows)
    assert first == ("r(k_0, k_ATP)", "−0.84 +- 0.15", "−0.80", "<b>near</b>", "found")
    assert second[4] == "† designed (there)"
    assert with_symbols(first[3]) == "&lt;b&gt;near&lt;/b&gt;"


def test_means_are_over_the_supported_subjects_alone() -> None:
    experiment = make_experiment("paper", {"A": True, "B": True, "E": False})
    experiment.scores.loc[0, "rmse_kpa"] = 1.0
    shown = {str(row.cells[0]): row.cells[1] for row in comparison_table([experiment], TITLE).rows}
    assert shown["Subjects prior-supported"] == "2 of 3 (A, B)"
    assert shown["RMSE, posterior (kPa)"] == "1.50 ± 0.71"
    rows = score_table(experiment, TITLE).rows
    assert [row.mark for row in rows] == ["", "", "muted", "summary", "summary"]
    assert [row.cells[2] for row in rows[2:]] == ["–", "1.50", "0.71"]


def test_both_recoveries_stand_side_by_side_at_every_level() -> None:
    rows = recovery_table([make_experiment("paper", {"A": True})]).rows
    assert len(rows) == 2 * len(THETA_NAMES)
    assert rows[-1].cells[3:7] == ("90", "25.0 (20.0 to 30.0)", "400", "12.5 (20.0 to 30.0)")


def test_intervals_that_cover_too_little_are_pointed_out() -> None:
    experiment = make_experiment("paper", {"A": True})
    assert "k_SR 12.5 %" in caution(experiment)
    experiment.recovery_acquisition["ci_high"] = 0.95
    assert caution(experiment) == ""


def test_experiments_differ_in_the_settings_that_were_changed() -> None:
    main = make_experiment("paper", {"A": True, "B": True})
    other = make_experiment("scalar_only", {"A": True, "B": False}, use_trajectory=False)
    rows = differences_table([other], main).rows
    assert [row.cells for row in rows] == [("scalar_only", "summary.use_trajectory", "true", "false")]
    shown = {str(row.cells[0]): row.cells[1:] for row in comparison_table([main, other], TITLE).rows}
    assert shown["Subjects prior-supported"] == ("2 of 2 (A, B)", "1 of 2 (A)")
    last = [row.cells for row in posterior_table([main, other], TITLE).rows[-2:]]
    assert [cells[3:6] for cells in last] == [("paper", "5.00", "4.00 to 6.00"), ("scalar_only", "–", "–")]
    larger = make_experiment("calibrated", {"A": True, "G": True})
    cells = posterior_table([main, larger], TITLE).rows[-1].cells  # a subject that the first does not have
    assert (cells[0], *cells[3:6]) == ("G", "calibrated", "5.00", "4.00 to 6.00")


def test_a_study_that_supports_nobody_is_shown() -> None:
    nobody = make_experiment("paper", {"A": False, "B": False})
    for make in (verdict_table, score_table, feature_table):
        assert all(row.mark == MUTED for row in make(nobody, TITLE).rows)
    assert all(row.mark == MUTED for row in posterior_table([nobody], TITLE).rows)
    assert derived_table(nobody, TITLE).rows == ()
    assert comparison_table([nobody], TITLE).rows[1].cells[1] == "–"


def test_training_names_the_epoch_of_the_lowest_validation_loss() -> None:
    row = training_table([make_experiment("paper", {"A": True})]).rows[0]
    assert row.cells == ("paper", "3", "2", "1.00", "2.00", "2.00")


def test_the_landing_page_says_who_is_not_to_be_read_and_why() -> None:
    experiment = make_experiment("paper", {name: name != "F" for name in "AFG"})
    statements = pd.DataFrame({"agrees": ["yes", "no", "yes"], "origin": ["found", "found", "designed"]})
    observations = tuple(map(observation, "AFG"))
    results = Results(observations, (experiment,), experiment, pd.DataFrame(), statements)
    landing = make_landing(results, TITLE, ())
    assert "2 prior-supported (A, G), 1 not prior-supported (F)" in landing["found"][0]
    limits = {row.cells[0]: row.cells[-1] for row in landing["answers"].rows}
    assert limits["A"] == "ejection fraction predicted above measured" and limits["F"] == "outside the prior"
    assert [card["subject"] for card in landing["cards"]] == list("AFG")
    assert "2 of the paper's 3 statements agree, 1 of them by design" in landing["paper"]


@pytest.mark.parametrize(
    ("n", "low", "high", "said"),
    [
        (320, 0.87, 0.94, "They keep their level where the model is right."),
        (320, 0.70, 0.80, "Too narrow: k_0."),
        (18, 0.65, 0.98, "18 recordings do not exclude that they contain it in 65 % only."),
    ],
)
def test_a_level_is_kept_only_where_the_recordings_could_show_that_it_is_not(
    n: int, low: float, high: float, said: str
) -> None:
    row = {"nominal": [0.9], "n": [n], "ci_low": [low], "ci_high": [high]}
    assert level_kept(pd.DataFrame(row, ["k0_kpa"])) == said


def test_a_panel_starts_at_zero_and_leaves_out_who_is_not_answered() -> None:
    rows = [("A", "not contradicted", 5.0, 4.0, 6.0), ("F", "contradicted", NAN, NAN, NAN)]
    drawn = panel("k_0", "kPa", pd.DataFrame(rows, columns=["subject", "status", "median", "low", "high"]))
    (mark,) = drawn["marks"]
    assert LEFT < mark["low"] < mark["median"] < mark["high"] <= drawn["right"]
    assert mark["median"] - mark["low"] == pytest.approx(mark["high"] - mark["median"], abs=0.2)
    assert drawn["ticks"][0] == (LEFT, "0")
    assert drawn["description"] == "k_0 in kPa: A 5.00 (4.00 to 6.00)"


def test_the_list_is_read_without_matplotlib() -> None:
    code = f"import sys, {registry.__name__}; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_every_figure_but_those_of_a_subject_is_on_the_page_and_drawn_by_a_rule() -> None:
    shown = {figure.name for scope in ON_PAGE for figure in on_page(scope).values()}
    assert {figure.name for figure in FIGURES if figure.of != "subject"} == shown
    assert {figure.rule for figure in FIGURES} <= set(STAGES)


def test_every_kind_of_figure_has_a_place_in_the_templates() -> None:
    missing = [
        kind for kind in KINDS if f"{SOURCES.get(kind[0], 'section.figures')}.{kind[1]}" not in TEMPLATE
    ]
    assert missing == []


def test_a_new_figure_of_the_cohort_stands_beside_the_others_of_which_none_may_be_missing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    spec = FigureSpec("new_figure", "new", "cohort", "a new figure", "What is new ({cohort}).", "New")
    monkeypatch.setattr(registry, "FIGURES", (*FIGURES, spec))
    pngs = [tmp_path / f"{name}.png" for name in ("workflow", "ppc", "posterior", "new")]
    for png in pngs:
        Image.new("L", (3, 2)).save(png)
    found = study_figures(pngs, [], tmp_path / "index.html", "paper", "virtual volunteers")
    assert [figure.caption for figure in found["further"]] == ["What is new (virtual volunteers)."]
    assert "page.figures.further" in TEMPLATE
    with pytest.raises(ArtefactError, match="figures of the study: .*ppc.* missing"):
        study_figures([], [], tmp_path / "index.html", "paper", "volunteers")
