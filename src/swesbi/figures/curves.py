"""Drawing one predictive check: observed curve, prior and posterior predictive, reference fit."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from swesbi.evaluation.scores import Band
from swesbi.evaluation.verdict import is_exact
from swesbi.figures.panels import PredictivePanel
from swesbi.figures.style import CMAES, EXCLUDED_POSTERIOR, OBSERVED, POSTERIOR, PRIOR
from swesbi.figures.text import percent

FloatArray = NDArray[np.float64]


def draw_predictions(axes: Axes, panel: PredictivePanel) -> None:
    """Draw prior and posterior predictive medians and intervals.

    A subject outside the prior's support has no posterior prediction in an experiment on features, and a
    grey one in an experiment on speeds, whose intervals are those of new recordings.
    """
    check = panel.check
    grid = check.target.grid
    label = f"{percent(check.interval)} PI"
    _draw_band(axes, grid, check.prior.curve, PRIOR, "--", ("prior median", f"prior {label}"))
    if check.supported:
        names = ("posterior median", f"posterior {label}")
        _draw_band(axes, grid, check.posterior.curve, POSTERIOR, "-", names)
    elif is_exact(panel.support):
        names = ("unsupported: median", f"unsupported: {label}")
        _draw_band(axes, grid, check.posterior.curve, EXCLUDED_POSTERIOR, "-", names)


def draw_observation(axes: Axes, panel: PredictivePanel) -> None:
    """Draw the observed curve and the measured phases with their standard errors."""
    target = panel.check.target
    axes.plot(target.grid, target.curve_kpa, color=OBSERVED, lw=0.7, label="observed curve", zorder=1.9)
    axes.errorbar(
        target.phase[target.measured],
        target.stiffness_kpa[target.measured],
        target.stiffness_se_kpa[target.measured],
        fmt="o",
        color=OBSERVED,
        ms=2.0,
        elinewidth=0.7,
        capsize=1.2,
        capthick=0.6,
        label="measured ± SE",
        zorder=4,
    )


def draw_fit(axes: Axes, panel: PredictivePanel) -> None:
    """Draw the curve of the CMA-ES reference fit."""
    axes.plot(panel.fit.grid, panel.fit.curve_kpa, color=CMAES, ls="-.", lw=1.0, label="CMA-ES best fit")


def _draw_band(
    axes: Axes, grid: FloatArray, values: Band, color: str, linestyle: str, labels: tuple[str, str]
) -> None:
    axes.plot(grid, values.median, color=color, ls=linestyle, label=labels[0])
    axes.fill_between(grid, values.low, values.high, color=color, alpha=0.25, lw=0, label=labels[1])
