"""The figure of identifiability: what is drawn of the tables and of the draws."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes

from swesbi.checks.identifiability.quantities import QUANTITY_NAMES
from swesbi.report.figures.identifiability import draw_identifiability
from swesbi.report.figures.style import Drawing

SUBJECTS = ("A", "B", "$C")
DURATION_S, ISOMETRIC_KPA = 0.3, 50.0
PHASES = (np.arange(20) + 0.5) / 20.0


def draws(subject: str) -> np.ndarray:
    rng = np.random.default_rng(len(subject))
    scores = rng.multivariate_normal(np.zeros(2), [[1.0, -0.8], [-0.8, 1.0]], 400)
    return np.asarray(np.column_stack([60.0 * np.exp(0.2 * scores[:, 0]), 6.0 * np.exp(0.2 * scores[:, 1])]))


def summary() -> pd.DataFrame:
    rows = [
        {
            "subject": subject, "quantity": name, "median": ISOMETRIC_KPA, "contraction_log": 0.5 + 0.1 * row,
            "sensitivity_prior": 0.02, "sensitivity_nuisances": 0.04, "sensitivity_likelihood": 0.3,
            "activation_duration_s": DURATION_S,
        }
        for subject in SUBJECTS
        for row, name in enumerate(QUANTITY_NAMES)
    ]  # fmt: skip
    return pd.DataFrame(rows)


@pytest.fixture(scope="module")
def figure() -> Drawing:
    posteriors: Any = {name: SimpleNamespace(phi=draws(name)) for name in SUBJECTS}
    information = pd.DataFrame(
        [
            {"subject": subject, "quantity": name, "phase": phase, "expected_sd_increase": 0.1 * phase}
            for subject in SUBJECTS
            for name in QUANTITY_NAMES
            for phase in PHASES[: 20 if subject == "A" else 15]
        ]
    )
    drawn = draw_identifiability(posteriors, summary(), information, cohort_title="test")
    drawn.draw_without_rendering()
    return drawn


def ticks(axes: Axes, axis: str) -> int:
    low, high = sorted(getattr(axes, f"get_{axis}lim")())
    return sum(low <= tick <= high for tick in getattr(axes, f"get_{axis}ticks")())


def test_every_quantity_has_its_row_and_every_part_its_colour(figure: Drawing) -> None:
    contraction, sensitivity = figure.axes[:2]
    x, y = contraction.lines[0].get_data()
    np.testing.assert_allclose(x, 0.5 + 0.1 * np.asarray(y))
    parts = [
        line for line in sensitivity.lines if len(line.get_xdata()) == len(SUBJECTS) * len(QUANTITY_NAMES)
    ]
    assert [line.get_xdata()[0] for line in parts] == [0.02, 0.04, 0.3]
    assert len({line.get_color() for line in parts}) == 3
    assert [str(line.get_label()) for line in sensitivity.lines][-1] == "0.05: sensitive"


def test_draws_stand_beside_the_line_of_their_isometric_stiffness(figure: Drawing) -> None:
    for axes, subject in zip(figure.axes[2:5], SUBJECTS, strict=True):
        points, line = axes.lines
        assert set(points.get_xdata()) <= set(draws(subject)[:, 1])
        k_atp, k_0 = map(np.asarray, line.get_data())
        np.testing.assert_allclose(k_0 * -np.expm1(-k_atp * DURATION_S), ISOMETRIC_KPA)
        r = np.corrcoef(np.log(draws(subject)).T)[0, 1]
        assert axes.get_title(loc="left").endswith(f"= −{-r:.2f}")
        assert "s$^{-1}$" in axes.get_xlabel() and axes.get_xscale() == axes.get_yscale() == "log"
    assert "kPa" in figure.axes[2].get_ylabel()


def test_the_loss_without_a_phase_is_in_percent_by_subject(figure: Drawing) -> None:
    panels = figure.axes[5:]
    assert len(panels) == len(QUANTITY_NAMES) and "%" in panels[0].get_ylabel()
    for axes in panels:
        assert [len(line.get_xdata()) for line in axes.lines] == [20, 15, 15]
        np.testing.assert_allclose(axes.lines[0].get_ydata(), 10.0 * PHASES)


def test_every_axis_has_three_marks_or_more(figure: Drawing) -> None:
    for axes in figure.axes:
        assert ticks(axes, "x") >= 3 and ticks(axes, "y") >= 3
