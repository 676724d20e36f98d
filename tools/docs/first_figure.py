"""The README's picture: one volunteer, from recording to posterior."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.stats import gaussian_kde

from swesbi.base.arrays import FloatArray
from swesbi.checks.predictive import PredictiveCheck
from swesbi.config.study import Study
from swesbi.draws import median_and_interval
from swesbi.parameters import THETA
from swesbi.posterior.truncated import Posterior
from swesbi.report.figures.style import (
    POSTERIOR,
    TRUTH,
    cycle_axis,
    draw_band,
    draw_points,
    drawing,
    shared_legend,
)
from swesbi.report.numbers import as_percent, digits

SUBJECT: Final = "G"
EXPERIMENT: Final = "calibrated"
MEANINGS: Final = ("How strongly it contracts", "How fast it contracts", "How fast it relaxes")
SHOWN: Final = 0.996


def first_figure(study: Study) -> Figure:
    """Return recording, prediction and three posteriors of a volunteer, beside the true parameters."""
    folder = Path(study.config.results) / EXPERIMENT / "subjects" / SUBJECT
    check, posterior = PredictiveCheck.read(folder / "predictive.h5"), Posterior.read(folder / "posterior.h5")
    true = pd.read_csv(study.cohort.folder / "truth.csv", index_col="subject").loc[[SUBJECT]]
    with drawing(7.0, 3.9) as figure:
        above: Any = [["recording"] * len(THETA), [parameter.name for parameter in THETA]]
        axes = figure.subplot_mosaic(above, height_ratios=(1.3, 1.0))
        _draw_recording(axes["recording"], check)
        for j, (parameter, meaning) in enumerate(zip(THETA, MEANINGS, strict=True)):
            panel, truth = axes[parameter.name], float(true[parameter.name].iloc[0])
            _draw_posterior(panel, posterior.theta[:, j], truth, posterior.interval_mass)
            panel.set_xlabel(f"{meaning}\n{parameter.label}")
        shared_legend(figure, [axes["recording"], axes[THETA[0].name]], entries_a_row=3)
    return figure


def _draw_recording(axes: Axes, check: PredictiveCheck) -> None:
    target, mass = check.target, as_percent(check.interval)
    label = f"predicted by the fitted model, {mass}"
    draw_band(axes, target.grid, check.posterior.observed, POSTERIOR, label)
    draw_points(
        axes, target.phase, target.stiffness_kpa, target.stiffness_se_kpa, "measured ± standard error"
    )
    cycle_axis(axes)
    axes.set(ylim=(0.0, None), ylabel="stiffness of the heart wall (kPa)")
    axes.set_title("One recording: the wall stiffens as the muscle contracts, and softens as it relaxes")


def _draw_posterior(axes: Axes, draws: FloatArray, true: float, mass: float) -> None:
    density = gaussian_kde(draws)
    low, median, high = map(float, median_and_interval(draws, mass))
    first, _, last = map(float, median_and_interval(draws, SHOWN))
    at = np.linspace(first, last, 300)
    inside = (at >= low) & (at <= high)
    axes.plot(at, density(at), color=POSTERIOR, label="posterior")
    interval = f"{as_percent(mass)} credible interval"
    axes.fill_between(at[inside], density(at[inside]), color=POSTERIOR, alpha=0.25, lw=0, label=interval)
    axes.axvline(true, color=TRUTH, ls="--", label="true value")
    axes.set(ylim=(0.0, None), yticks=[], title=f"{digits(median)} ({digits(low)} to {digits(high)})")
