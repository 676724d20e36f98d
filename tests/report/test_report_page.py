"""The landing page: numbers, tables, links, and what it says when nothing is supported."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from matplotlib.figure import Figure as Drawing
from report_case import make_experiment

from swesbi.artefacts import ArtefactError
from swesbi.parameters import THETA_NAMES
from swesbi.report.columns import _BY_SOURCE, _OF_SEVERAL
from swesbi.report.figures.style import save_figure
from swesbi.report.numbers import (
    estimate,
    fixed,
    mean_sd,
    percent,
    significant,
    span,
    with_symbols,
)
from swesbi.report.page.files import figure
from swesbi.report.page.sections import caution
from swesbi.report.paper.comparison import COMPARISON
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


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.012345, "0.0123"),
        (9.996, "10.0"),
        (-154.67, "−155"),
        (120000.0, "120,000"),
        (0.0, "0"),
        (28.0, "28.0"),
        (math.nan, "–"),
        (math.inf, "inf"),
    ],
)
def test_significant_digits_are_kept_through_every_size(value: float, text: str) -> None:
    assert significant(value) == text


def test_numbers_have_a_true_minus_and_zero_has_none() -> None:
    assert fixed(-0.8432, 2) == "−0.84"
    assert fixed(-0.001, 2) == "0.00"
    assert percent(0.905) == "90.5"
    assert span("1.0", "2.0") == "1.0 to 2.0"
    assert span(fixed(math.nan, 1), fixed(math.nan, 1)) == "–"


def test_a_narrow_interval_has_the_digits_that_show_its_width() -> None:
    assert estimate(53.66, 53.52, 53.83) == ("53.66", "53.52 to 53.83")
    assert estimate(40.0, 16.4, 69.6) == ("40.0", "16.4 to 69.6")
    assert estimate(114.2, 114.11, 114.31) == ("114.20", "114.11 to 114.31")
    assert estimate(2.0, 2.0, 2.0) == ("2.00", "2.00 to 2.00")
    assert estimate(113.97, 113.9678, 113.9745, most_decimals=0) == ("114", "114 to 114")
    assert estimate(math.nan, math.nan, math.nan) == ("–", "–")


def test_the_spread_is_that_of_a_sample() -> None:
    assert mean_sd([1.0, 2.0, 4.0], 2) == "2.33 ± 1.53"
    assert mean_sd([1.25], 2) == "1.25"
    assert mean_sd([], 2) == "–"


def test_a_predicted_quantity_beside_the_measured_says_so_in_words() -> None:
    row = {"median": 0.724, "low": 0.690, "high": 0.743}
    assert beside_the_measured(row | {"measured": 0.619}) == "predicted above measured"
    assert beside_the_measured(row | {"measured": 0.8}) == "predicted below measured"
    assert beside_the_measured(row | {"measured": 0.7}) == "holds the measured"
    assert beside_the_measured(row | {"measured": math.nan}) == "–"


def test_a_column_of_several_values_is_an_interval_or_a_value_with_its_own() -> None:
    row = {"value": 0.905, "low": 0.88, "high": 0.92, "none": math.nan}
    assert Column("value", "Coverage", "%", "0%").cell(row) == "90"
    assert Column(("low", "high"), "Interval", "", "2f").cell(row) == "0.88 to 0.92"
    assert Column(("value", "low", "high"), "Coverage", "%", "1%").cell(row) == "90.5 (88.0 to 92.0)"
    assert Column(("none", "none", "none"), "Coverage", "%", "1%").cell(row) == "–"
    with pytest.raises(KeyError):
        Column("absent", "Coverage").cell(row)


def test_no_column_is_defined_twice() -> None:
    assert len({column.source for column in _BY_SOURCE}) == len(_BY_SOURCE)
    assert {str(column.source) for column in _BY_SOURCE}.isdisjoint(_OF_SEVERAL)


def test_words_may_have_other_names() -> None:
    column = words("sampler", "Answer", {"mcmc": "MCMC", "": "–"})
    assert [column.cell({"sampler": name}) for name in ("mcmc", "", "other", None)] == [
        "MCMC",
        "–",
        "other",
        "–",
    ]


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
    first, second = paper_table(COMPARISON.read(path), TITLE).rows
    assert (first.cells[4], second.cells[4]) == ("found", "† designed (there)")
    cells = first.cells
    assert cells[0] == "r(k_0, k_ATP)"
    assert cells[1:3] == ("−0.84 +- 0.15", "−0.80")
    assert cells[3] == "<b>near</b>" and with_symbols(cells[3]) == "&lt;b&gt;near&lt;/b&gt;"
    path.write_text("quantity,paper\n")
    with pytest.raises(ArtefactError, match="lacks the columns this_study, note, origin"):
        COMPARISON.read(path)


def test_means_are_over_the_supported_subjects_alone() -> None:
    experiment = make_experiment("paper", {"A": True, "B": True, "E": False})
    experiment.scores.loc[0, "rmse_kpa"] = 1.0
    shown = {str(row.cells[0]): row.cells[1] for row in comparison_table([experiment], TITLE).rows}
    assert shown["Subjects prior-supported"] == "2 of 3 (A, B)"
    assert shown["RMSE, posterior (kPa)"] == "1.50 ± 0.71"
    rows = score_table(experiment, TITLE).rows
    assert [row.mark for row in rows] == ["", "", "muted", "summary", "summary"]
    assert [row.cells[2] for row in rows[-2:]] == ["1.50", "0.71"]
    assert rows[2].cells[2] == "–"


def test_both_recoveries_stand_side_by_side_at_every_level() -> None:
    rows = recovery_table([make_experiment("paper", {"A": True})]).rows
    assert len(rows) == 2 * len(THETA_NAMES)
    assert rows[-1].cells[3:7] == ("90", "25.0 (20.0 to 30.0)", "400", "12.5 (20.0 to 30.0)")


def test_intervals_that_cover_too_little_are_pointed_out() -> None:
    experiment = make_experiment("paper", {"A": True})
    assert "contain the truth less often" in caution(experiment)
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
    assert shown["RMSE, posterior (kPa)"] == ("2.00 ± 0.00", "2.00")
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
