"""The panels of figure 1, each drawn from one subject's own results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, MaxNLocator, NullFormatter, NullLocator, ScalarFormatter
from numpy.typing import NDArray
from scipy.stats import gaussian_kde

from swesbi.checks.predictive import PredictiveCheck
from swesbi.context import CONTEXT_NAMES, Context
from swesbi.measurement.settings import SCALAR_NAMES
from swesbi.parameters import THETA_LABELS
from swesbi.prior import PriorSettings
from swesbi.report.figures.density import log_density_of_prior
from swesbi.report.figures.style import CMAES, OBSERVED, POSTERIOR, PRIOR
from swesbi.verdict.prior_support import support_numbers
from swesbi.verdict.verdict import Verdict

FloatArray = NDArray[np.float64]
SMALL_PT = 5.2
SHOWN_CURVES = 60
SHOWN_QUANTILES = (0.002, 0.998)
POOL_BAND = (0.05, 0.95)
LARGEST_Z = 4.5
GROUP_COLORS = {"scalars": "#E69F00", "trajectory": "#56B4E9", "context": "#CC79A7"}
EXCLUDED = "#6E6E6E"
KEY_STEP = 0.105


@dataclass(frozen=True)
class WorkflowPicture:
    """What the workflow figure shows of one subject.

    Attributes:
        subject: Name.
        context: Its context.
        prior: The prior.
        check: Its predictive check: prior curves, recording, posterior predictive.
        components: Names of the C components of z.
        pool_z: (n, C) rows of the pool that are of this subject.
        sample_z: (N_aug, C) the noisy copies of one simulation among them.
        z_obs: (C,) observed conditioning vector.
        theta: (m, parameters) posterior draws; unfiltered candidates where the subject is excluded.
        verdict: The verdict.
        history: Losses by epoch.
        estimator: What the density estimator is called ("MAF").
        subjects: Number of subjects pooled.
        rows: Size of the pool.
    """

    subject: str
    context: Context
    prior: PriorSettings
    check: PredictiveCheck
    components: tuple[str, ...]
    pool_z: FloatArray
    sample_z: FloatArray
    z_obs: FloatArray
    theta: FloatArray
    verdict: Verdict
    history: pd.DataFrame
    estimator: str
    subjects: int
    rows: int


def draw_prior(axes: Sequence[Axes], picture: WorkflowPicture) -> None:
    """Draw the prior density of each parameter on a logarithmic axis."""
    for panel, prior, label in zip(axes, picture.prior.parameters, THETA_LABELS, strict=True):
        theta, density = log_density_of_prior(prior)
        panel.fill_between(theta, density, color=PRIOR, alpha=0.5, lw=0)
        panel.set_xscale("log")
        panel.set_xlim(prior.low, prior.high)
        panel.xaxis.set_major_locator(FixedLocator([prior.low, prior.centre, prior.high]))
        panel.xaxis.set_major_formatter(ScalarFormatter())
        panel.xaxis.set_minor_locator(NullLocator())
        _finish_density(panel, label)


def draw_posterior(axes: Sequence[Axes], picture: WorkflowPicture) -> None:
    """Draw the marginal posteriors, each on its own scale, with the median."""
    color = POSTERIOR if picture.verdict.may_be_read else EXCLUDED
    for j, (panel, label) in enumerate(zip(axes, THETA_LABELS, strict=True)):
        draws = picture.theta[:, j]
        low, median, high = map(float, np.quantile(draws, [SHOWN_QUANTILES[0], 0.5, SHOWN_QUANTILES[1]]))
        if low < high:
            at = np.linspace(low, high, 200)
            panel.fill_between(at, gaussian_kde(draws)(at), color=color, alpha=0.45, lw=0)
            panel.set_xlim(low, high)
        panel.axvline(median, color="black", lw=0.7)
        panel.xaxis.set_major_locator(MaxNLocator(2, prune="both", min_n_ticks=1))
        panel.xaxis.set_minor_formatter(NullFormatter())
        _finish_density(panel, label)


def draw_curves(axes: Axes, picture: WorkflowPicture) -> None:
    """Draw simulated total stiffness curves of this subject, from the prior."""
    check = picture.check
    curves = check.prior.draws.curve_kpa[:SHOWN_CURVES]
    axes.plot(check.target.grid, curves.T, color=PRIOR, lw=0.35, alpha=0.7)
    _finish_curves(axes, float(curves.max()))


def draw_recording(axes: Axes, picture: WorkflowPicture) -> None:
    """Draw the measured phases with their standard errors, and the observed curve through them."""
    target = picture.check.target
    axes.plot(target.grid, target.curve_kpa, color=OBSERVED, lw=0.6)
    _draw_phases(axes, picture)
    _finish_curves(axes, float(target.curve_kpa.max()))


def draw_check(axes: Axes, picture: WorkflowPicture) -> None:
    """Draw the predictive medians with the posterior's interval, over the measured phases."""
    check, grid = picture.check, picture.check.target.grid
    axes.plot(grid, check.prior.curve.median, color=PRIOR, ls="--", lw=0.8)
    if check.may_be_read:
        curve = check.posterior.curve
        axes.fill_between(grid, curve.low, curve.high, color=POSTERIOR, alpha=0.3, lw=0)
        axes.plot(grid, curve.median, color=POSTERIOR, lw=0.8)
    _draw_phases(axes, picture)
    _finish_curves(axes, float(check.target.curve_kpa.max()))
    excluded = dict.fromkeys(support_numbers(picture.verdict), EXCLUDED)
    last = {"posterior": POSTERIOR} if check.may_be_read else excluded
    _write_key(axes, {"measured": OBSERVED, "prior": PRIOR} | last)


def draw_training(axes: Axes, picture: WorkflowPicture) -> None:
    """Draw training and validation loss by epoch."""
    history = picture.history
    axes.plot(history["epoch"], history["training_loss"], color=POSTERIOR, lw=0.8)
    axes.plot(history["epoch"], history["validation_loss"], color=CMAES, ls="--", lw=0.7)
    axes.xaxis.set_major_locator(MaxNLocator(2, integer=True, steps=[1, 5, 10]))
    axes.yaxis.set_major_locator(MaxNLocator(4))
    axes.set_xlabel("epoch", fontsize=SMALL_PT, labelpad=1.0)
    _write_key(axes, {"training loss": POSTERIOR, "validation loss": CMAES})


def draw_features(axes: Axes, picture: WorkflowPicture) -> None:
    """Draw the noisy copies of one simulation's features and context, standardised, over the pool's range."""
    _draw_pool_range(axes, picture)
    position = np.arange(len(picture.components))
    for row in picture.sample_z:
        axes.plot(position, row, ".", ms=1.8, color=OBSERVED, alpha=0.4, mew=0)
    _finish_components(axes, picture, np.abs(picture.sample_z).max())


def draw_observed_features(axes: Axes, picture: WorkflowPicture) -> None:
    """Draw the observed conditioning vector over the pool's range."""
    _draw_pool_range(axes, picture)
    axes.plot(np.arange(len(picture.z_obs)), picture.z_obs, ".", ms=2.2, color=POSTERIOR, mew=0)
    _finish_components(axes, picture, np.abs(picture.z_obs).max())


def groups(components: Sequence[str]) -> Iterator[tuple[str, int, int]]:
    """Yield name, first and last position of each group of components that is there."""
    kinds = [
        "context" if name in CONTEXT_NAMES else "scalars" if name in SCALAR_NAMES else "trajectory"
        for name in components
    ]
    for name in GROUP_COLORS:
        if name in kinds:
            yield name, kinds.index(name), len(kinds) - 1 - kinds[::-1].index(name)


def _draw_pool_range(axes: Axes, picture: WorkflowPicture) -> None:
    low, high = np.quantile(picture.pool_z, POOL_BAND, axis=0)
    position = np.arange(len(low))
    axes.vlines(position, low, high, color=PRIOR, lw=1.0, alpha=0.45)


def _finish_components(axes: Axes, picture: WorkflowPicture, largest: float) -> None:
    """Mark the groups by colour along the bottom, with their sizes."""
    reach = min(max(3.2, 1.1 * float(largest)), LARGEST_Z)
    axes.set_ylim(-1.45 * reach, reach)
    for name, first, last in groups(picture.components):
        color = GROUP_COLORS[name]
        axes.axvspan(first - 0.5, last + 0.5, ymax=0.05, color=color, lw=0)
        axes.text(
            (first + last) / 2.0,
            0.065,
            f"{last - first + 1}\n{name}" if name != "context" else f"{last - first + 1}\ncont.",
            transform=axes.get_xaxis_transform(),
            ha="center",
            va="bottom",
            fontsize=SMALL_PT,
            linespacing=0.95,
        )
    axes.set_xlim(-1.0, len(picture.components))
    axes.set_xticks([])
    axes.set_xlabel("grey: 90 % of its simulations", fontsize=SMALL_PT, labelpad=2.0)
    axes.set_yticks([-3, 0, 3], ["−3", "0", "3"])


def _draw_phases(axes: Axes, picture: WorkflowPicture) -> None:
    target = picture.check.target
    shown = target.measured
    measured = (target.phase[shown], target.stiffness_kpa[shown], target.stiffness_se_kpa[shown])
    axes.errorbar(*measured, fmt="o", color=OBSERVED, ms=1.3, elinewidth=0.5, zorder=4)


def _finish_curves(axes: Axes, highest: float) -> None:
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.1 * highest)
    axes.set_xticks([0.0, 0.5, 1.0], ["0", "0.5", "1"])
    axes.yaxis.set_major_locator(MaxNLocator(4))
    axes.set_xlabel("cycle fraction $s$", fontsize=SMALL_PT, labelpad=1.0)


def _finish_density(axes: Axes, label: str) -> None:
    axes.set_ylim(bottom=0.0)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.set_ylabel(
        label.replace(" (", "\n("), fontsize=SMALL_PT, rotation=0, ha="right", va="center", labelpad=2.0
    )


def _write_key(axes: Axes, colors: Mapping[str, str]) -> None:
    """Name the lines in their colours, at the upper right."""
    for line, (name, color) in enumerate(colors.items()):
        place: dict[str, Any] = {"transform": axes.transAxes, "ha": "right", "va": "top"}
        axes.text(1.0, 1.0 - KEY_STEP * line, name, color=color, fontsize=SMALL_PT, **place)
