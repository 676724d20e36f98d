from __future__ import annotations

from functools import cache
from pathlib import Path

import evaluation_cases
import exact_shown
import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from evaluation_cases import INTERVAL, PRIOR, TITLE, posterior_panels, predictive_panels
from figure_text import assert_text_apart, text_boxes
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from PIL import Image
from scipy.stats import gaussian_kde

from swesbi.artefacts import ArtefactError
from swesbi.checks.scores import Band
from swesbi.draws import density_of_pairs, kernel_density
from swesbi.networks.training import TRAINING
from swesbi.report.figures.calibration import draw_training
from swesbi.report.figures.forest import Panel, Series, forest, intervals
from swesbi.report.figures.posterior import (
    DENSITY_QUANTILES,
    PosteriorPanel,
    draw_corner,
    draw_posteriors,
    log_density_of_draws,
    log_density_of_prior,
    prior_band,
)
from swesbi.report.figures.predictive import PredictivePanel, draw_cohort_checks, draw_subject_check
from swesbi.report.figures.style import (
    EXCLUDED_BACKGROUND,
    draw_band,
    draw_points,
    in_percent,
    plain_decades,
    save_figure,
)

MANY = [f"patient-{number:03d}" for number in range(14)]
LOOK = {"own": Series("#000000", "its own"), "other": Series("#8C8C8C", "the other's")}


def history(epochs: int = 30) -> pd.DataFrame:
    epoch = np.arange(1, epochs + 1)
    loss = 3.0 * np.exp(-epoch / 8.0)
    return pd.DataFrame({"epoch": epoch, "training_loss": loss, "validation_loss": loss + 0.002 * epoch})


def checks(*subjects: str) -> list[PredictivePanel]:
    return [exact_shown.predictive_panel(name) for name in subjects]


def posteriors(*subjects: str) -> list[PosteriorPanel]:
    return [exact_shown.panel(name, truth=subjects != ("F",)) for name in subjects]


DRAWN = {
    "ppc": lambda: draw_cohort_checks(predictive_panels(), TITLE),
    "ppc-many": lambda: draw_cohort_checks(predictive_panels(MANY, MANY[3:5]), TITLE),
    "ppc-exact": lambda: draw_cohort_checks(checks(*"ABCDEF"), TITLE),
    "ppc-F": lambda: draw_subject_check(predictive_panels("F", "F")[0], TITLE),
    "ppc-exact-D": lambda: draw_subject_check(*checks("D"), TITLE),
    "posterior": lambda: draw_posteriors(posterior_panels(), PRIOR, TITLE),
    "posterior-many": lambda: draw_posteriors(posterior_panels(MANY, MANY[3:5]), PRIOR, TITLE),
    "posterior-one": lambda: draw_posteriors(posterior_panels("A", ""), PRIOR, TITLE),
    "posterior-exact": lambda: draw_posteriors(posteriors(*"ABCDEF"), exact_shown.PRIOR, TITLE),
    "posterior-exact-one": lambda: draw_posteriors(posteriors("F"), exact_shown.PRIOR, TITLE),
    "posterior-F": lambda: draw_corner(posterior_panels("F")[0], PRIOR, TITLE),
    "posterior-exact-F": lambda: draw_corner(*posteriors("F"), exact_shown.PRIOR, TITLE),
    "training": lambda: draw_training(history(), trained_on=TITLE),
}


@cache
def drawn(name: str) -> Figure:
    return DRAWN[name]()


@pytest.mark.parametrize("name", DRAWN)
def test_text_stands_apart_and_names_the_cohort_and_axes_have_three_ticks_or_none(name: str) -> None:
    assert_text_apart(drawn(name))
    assert any(TITLE in text for text, _ in text_boxes(drawn(name)))
    shown = [axes for axes in drawn(name).axes if axes.axison and not name.endswith("-one")]
    counts = [ticks_in_view(axis) for axes in shown for axis in (axes.xaxis, axes.yaxis)]
    assert [count for count in counts if count in (1, 2)] == []


def test_the_overlap_test_can_fail() -> None:
    figure = Figure(figsize=(3.0, 2.0))
    axes = figure.subplots()
    axes.text(0.5, 0.5, "one text")
    axes.text(0.52, 0.5, "another")
    with pytest.raises(AssertionError, match="'one text' overlaps 'another'"):
        assert_text_apart(figure)


def ticks_in_view(axis: Axis) -> int:
    low, high = sorted(axis.get_view_interval())
    return sum(low <= place <= high for place in axis.get_majorticklocs())


@pytest.mark.parametrize(("low", "high"), [(10, 200), (21, 44), (2.0, 6.1), (1e-4, 1e4), (30.0, 31.0)])
def test_ticks_of_a_logarithmic_axis_are_three_or_more_and_plain(low: float, high: float) -> None:
    axes = Figure().subplots()
    axes.set(xscale="log", xlim=(low, high))
    plain_decades(axes.xaxis)
    assert ticks_in_view(axes.xaxis) >= 3
    assert axes.xaxis.get_major_formatter()(20.0) == "20"


def test_percents_that_differ_are_told_apart() -> None:
    axes = Figure().subplots()
    in_percent(axes.xaxis)
    assert list(map(axes.xaxis.get_major_formatter(), (0.0, 0.005, 0.01))) == ["0 %", "0.5 %", "1 %"]


def rows() -> pd.DataFrame:
    return pd.DataFrame(
        [("A", "own", 1.0, 2.0, 4.0), ("B", "own", 3.0, 5.0, 6.0), ("B", "other", np.nan, np.nan, np.nan)],
        columns=["row", "series", "low", "median", "high"],
    ).assign(panel="k")


def segments(axes: Axes) -> list[list[list[float]]]:
    lines = [each for each in axes.collections if isinstance(each, LineCollection)]
    return [segment.tolist() for each in lines for segment in each.get_segments()]


def test_intervals_run_from_end_to_end_through_the_median() -> None:
    axes = Figure().subplots()
    intervals(axes, rows(), {"own": LOOK["own"]}, order=["B", "A"])
    assert segments(axes) == [[[1.0, 1.0], [4.0, 1.0]], [[3.0, 0.0], [6.0, 0.0]]]
    assert np.asarray(axes.lines[0].get_xydata()).tolist() == [[2.0, 1.0], [5.0, 0.0]]
    upright = Figure().subplots()
    placed = rows().assign(row=[7.0, 9.0, 9.0])
    intervals(upright, placed, LOOK, upright=True)
    assert segments(upright) == [[[7.0, 1.0], [7.0, 4.0]], [[9.0, 3.0], [9.0, 6.0]]]


def test_series_of_a_row_stand_apart_unless_they_share_a_lane() -> None:
    table = rows().assign(low=1.0, median=2.0, high=3.0)
    for lane, apart in ((None, True), ("same", False)):
        axes = Figure().subplots()
        look = {name: Series("#000000", name, lane=lane) for name in LOOK}
        intervals(axes, table, look, order=["A", "B"])
        heights = {name: line.get_ydata()[-1] for name, line in zip(LOOK, axes.lines[::2], strict=True)}
        assert (heights["own"] != heights["other"]) == apart


def test_a_forest_names_its_rows_and_leaves_out_a_series_without_numbers() -> None:
    panels = {"k": Panel("$k$ (kPa)", "stiffness", "log", mark=2.0)}
    figure = forest(rows(), panels, LOOK, title="Some", names={"A": "first", "B": "B"})
    (axes,) = figure.axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["first", "B"]
    assert (axes.get_title("left"), axes.get_xlabel(), axes.get_xscale()) == ("$k$ (kPa)", "stiffness", "log")
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["its own"]
    with pytest.raises(ValueError, match="no row to draw"):
        forest(rows().iloc[:0], panels, LOOK, title="None")


def test_a_band_and_points_show_what_was_measured() -> None:
    axes, phase = Figure().subplots(), np.array([0.1, 0.5, 0.9])
    draw_band(axes, phase, Band(phase, phase - 0.1, phase + 0.2), "#000000", "prior")
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), phase)
    edges = axes.collections[0].get_paths()[0].get_extents()
    assert (edges.y0, edges.y1) == pytest.approx((0.0, 1.1))
    draw_points(axes, phase, np.array([1.0, np.nan, 3.0]), np.full(3, 0.5), "measured")
    assert axes.lines[-1].get_xdata().tolist() == [0.1, 0.9]
    assert axes.get_legend_handles_labels()[1] == ["prior", "measured"]


def test_excluded_subjects_are_greyed_and_say_why() -> None:
    panels = drawn("ppc").axes
    grey = tuple(int(EXCLUDED_BACKGROUND[i : i + 2], 16) / 255 for i in (1, 3, 5))
    greyed = [axes.get_facecolor()[:3] == pytest.approx(grey) for axes in panels]
    assert greyed == [False] * 4 + [True] * 2
    assert "0 in-prior draws" in panels[5].texts[0].get_text()
    labels = [axes.get_legend_handles_labels()[1] for axes in (panels[0], panels[5])]
    assert [any(label.startswith("posterior") for label in each) for each in labels] == [True, False]


def test_a_cohort_of_features_shows_medians_and_where_the_excluded_went() -> None:
    axes = drawn("posterior").axes[0]
    panels = posterior_panels()
    by_label = {axes.lines[i + 1].get_label(): axes.lines[i] for i in range(len(axes.lines) - 1)}
    medians = [np.median(panel.draws[:, 0]) for panel in panels[:4]]
    np.testing.assert_allclose(by_label["posterior"].get_xdata(), medians)
    candidates = by_label["excluded (grey): median of the candidates"].get_xdata()
    np.testing.assert_array_equal(candidates, [evaluation_cases.TRUE_THETA[name][0] for name in "EF"])
    ends = [np.quantile(panels[0].draws[:, 0], level) for level in (0.05, 0.95)]
    assert [[point[0] for point in segment] for segment in segments(axes)].count(ends) == 1


def test_a_cohort_of_exact_posteriors_shows_verdicts_and_the_weights() -> None:
    figure = drawn("posterior-exact")
    weights, mcmc = (figure.axes[-1].lines[i].get_xdata() for i in (0, 1))
    assert weights.tolist() == [0.82] * 5
    assert mcmc.tolist() == [0.02]
    labels = {text.get_text() for text in figure.legends[0].get_texts()}
    status = {f"posterior, {word}" for word in ("not contradicted", "doubtful", "contradicted")}
    assert status | {"network alone", "truth", "CMA-ES fit", "draws by MCMC"} <= labels


def test_a_large_cohort_shows_its_first_subjects_and_says_so() -> None:
    panel = posterior_panels("A", "")[0]
    many = [PosteriorPanel(f"S{i:02d}", panel.verdict, panel.draws, INTERVAL) for i in range(50)]
    figure = draw_posteriors(many, PRIOR, TITLE)
    assert "the first 40 of 50 subjects" in figure.get_suptitle()
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()][-1] == "S39"


def test_files_are_the_same_twice_and_hold_no_time_and_whole_fonts(tmp_path: Path) -> None:
    for part in ("one", "other"):
        figure = draw_cohort_checks(checks("A"), TITLE)
        save_figure(figure, tmp_path / f"{part}.png", tmp_path / f"{part}.pdf")
    for suffix in ("png", "pdf"):
        one, other = ((tmp_path / f"{part}.{suffix}").read_bytes() for part in ("one", "other"))
        assert one == other
        assert b"CreationDate" not in one and b"tIME" not in one
    assert b"/FontFile2" in one and b"/Type3" not in one
    with pytest.raises(ValueError, match=r"\.pdf or \.png"):
        save_figure(figure, tmp_path / "ppc.svg")


def test_figures_of_huge_cohorts_stay_within_what_libraries_open(tmp_path: Path) -> None:
    save_figure(Figure(figsize=(400.0, 1.0)), tmp_path / "wide.png")
    with Image.open(tmp_path / "wide.png") as image:
        assert image.width == 30_000


def test_figures_do_not_depend_on_the_users_style(tmp_path: Path) -> None:
    save_figure(draw_training(history(), trained_on=TITLE), tmp_path / "plain.png")
    with mpl.rc_context({"font.size": 20.0, "axes.facecolor": "pink", "savefig.bbox": "tight"}):
        save_figure(draw_training(history(), trained_on=TITLE), tmp_path / "styled.png")
    assert (tmp_path / "plain.png").read_bytes() == (tmp_path / "styled.png").read_bytes()


def test_a_training_history_without_an_epoch_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "training.csv"
    history(0).to_csv(path, index=False)
    with pytest.raises(ArtefactError, match="training.csv: holds no epoch"):
        TRAINING.read(path)


def test_densities_integrate_to_one_over_log_theta_and_the_band_holds_nine_tenths() -> None:
    bands = prior_band(PRIOR).T
    for prior, (low, high) in zip(PRIOR.parameters, bands, strict=True):
        theta, density = log_density_of_prior(prior)
        assert np.trapezoid(density, np.log(theta)) == pytest.approx(1.0, abs=1e-3)
        inside = (theta >= low) & (theta <= high)
        assert np.trapezoid(density[inside], np.log(theta[inside])) == pytest.approx(0.9, abs=0.02)
    draws = np.exp(np.random.default_rng(0).normal(1.0, 0.3, 5000))
    theta, density = log_density_of_draws(draws)
    assert np.trapezoid(density, np.log(theta)) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("width", [None, 1e-4])
def test_densities_of_draws_are_those_of_scipy(width: float | None) -> None:
    """Of many draws they are counted in cells; a width far below their spread is of each draw."""
    x = np.exp(0.4 * np.random.default_rng(1).normal(size=5000))
    at = np.linspace(0.3, 3.0, 200)
    expected = gaussian_kde(x, bw_method=None if width is None else width / x.std(ddof=1))(at)
    np.testing.assert_allclose(kernel_density(x, at, width), expected, atol=3e-4 * expected.max())


def test_the_density_of_pairs_is_that_of_scipy_but_for_its_factor() -> None:
    rng = np.random.default_rng(2)
    x = np.exp(0.4 * rng.normal(size=2000))
    y = np.sqrt(x) * np.exp(0.1 * rng.normal(size=2000))  # correlated, and bent
    across, up = (
        np.linspace(*np.quantile(draws, DENSITY_QUANTILES), points) for draws, points in ((x, 50), (y, 40))
    )
    found = density_of_pairs(x, y, across, up)
    assert found.shape == (40, 50)
    expected = gaussian_kde(np.stack([x, y]))(np.stack([each.ravel() for each in np.meshgrid(across, up)]))
    found, expected = found / found.max(), expected.reshape(found.shape) / expected.max()
    np.testing.assert_allclose(found, expected, atol=0.02)  # draws beyond the grid are left out
