"""Figure 1: the workflow, drawn from one subject's own curves, features and posterior.

(a) prior and context -> simulated curves -> noisy features -> training; (b) recording -> observed features ->
posterior -> predictive check.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch
from matplotlib.path import Path as MplPath
from matplotlib.ticker import FixedLocator, MaxNLocator, NullFormatter, NullLocator, ScalarFormatter
from numpy.typing import NDArray
from scipy.stats import gaussian_kde

from swesbi.checks.predictive import PredictiveCheck
from swesbi.context import CONTEXT_NAMES, Context
from swesbi.measurement.settings import SCALAR_NAMES
from swesbi.parameters import THETA_LABELS
from swesbi.prior import PriorSettings
from swesbi.show.figures.density import log_density_of_prior
from swesbi.show.figures.style import (
    CMAES,
    OBSERVED,
    POSTERIOR,
    PRIOR,
    TEXT_WIDTH_IN,
    mark_excluded,
    new_figure,
    style,
)
from swesbi.verdict.support import Support, support_numbers

FloatArray = NDArray[np.float64]

SMALL_PT = 5.2
SHOWN_CURVES = 60
SHOWN_QUANTILES = (0.002, 0.998)
POOL_BAND = (0.05, 0.95)
LARGEST_Z = 4.5
GROUP_COLORS = {"scalars": "#E69F00", "trajectory": "#56B4E9", "context": "#CC79A7"}
EXCLUDED = "#6E6E6E"
KEY_STEP = 0.105
HEIGHT_IN: Final = 3.52
TITLE_PT: Final = 6.2
PANEL_HEIGHT_IN: Final = 0.94
TITLE_ABOVE_IN: Final = 0.10
ARROW_ABOVE_IN: Final = 0.18
HEAD_ABOVE_IN: Final = 0.37
LONGEST_NAME: Final = 24
ROW_A: Final = 2.11
ROW_B: Final = 0.32


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
        theta: (m, 3) posterior draws; unfiltered candidates where the subject is excluded.
        support: Support diagnostics.
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
    support: Support
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
    color = POSTERIOR if picture.support.supported else EXCLUDED
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
    if check.supported:
        curve = check.posterior.curve
        axes.fill_between(grid, curve.low, curve.high, color=POSTERIOR, alpha=0.3, lw=0)
        axes.plot(grid, curve.median, color=POSTERIOR, lw=0.8)
    _draw_phases(axes, picture)
    _finish_curves(axes, float(check.target.curve_kpa.max()))
    excluded = dict.fromkeys(support_numbers(picture.support), EXCLUDED)
    last = {"posterior": POSTERIOR} if check.supported else excluded
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


def context_line(context: Context) -> str:
    """Return the context in a line."""
    return (
        f"{context.sex}, {context.age_years:g} y, BSA {context.bsa_m2:g} m², HR {context.hr_bpm:g} bpm, "
        f"LVEDV {context.lvedv_ml:g} mL, LVESV {context.lvesv_ml:g} mL, IVSd {context.ivsd_cm:g} cm"
    )


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
    axes.errorbar(
        target.phase[shown],
        target.stiffness_kpa[shown],
        target.stiffness_se_kpa[shown],
        fmt="o",
        color=OBSERVED,
        ms=1.3,
        elinewidth=0.5,
        zorder=4,
    )


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
        axes.text(
            1.0,
            1.0 - KEY_STEP * line,
            name,
            color=color,
            transform=axes.transAxes,
            ha="right",
            va="top",
            fontsize=SMALL_PT,
        )


class Box(NamedTuple):
    """Where a panel's axes lie, in inches from the lower left corner."""

    left: float
    bottom: float
    width: float
    height: float = PANEL_HEIGHT_IN

    @property
    def middle(self) -> float:
        """Horizontal middle."""
        return self.left + self.width / 2.0


PRIOR_BOX: Final = Box(0.38, ROW_A, 0.56)
CURVES_BOX: Final = Box(1.20, ROW_A, 0.92)
FEATURES_BOX: Final = Box(2.38, ROW_A, 1.30)
TRAINING_BOX: Final = Box(3.94, ROW_A, 0.78)
RECORDING_BOX: Final = Box(0.24, ROW_B, 0.92)
OBSERVED_BOX: Final = Box(1.42, ROW_B, 1.20)
POSTERIOR_BOX: Final = Box(3.02, ROW_B, 0.60)
CHECK_BOX: Final = Box(3.88, ROW_B, 0.84)


def draw_workflow(picture: WorkflowPicture, cohort_title: str) -> Figure:
    """Draw the workflow.

    Args:
        picture: The subject that is shown.
        cohort_title: What the subject is one of ("virtual volunteers").
    """
    with style():
        figure = new_figure(TEXT_WIDTH_IN, HEIGHT_IN)
        figure.set_layout_engine("none")
        draw_prior(_stack(figure, PRIOR_BOX), picture)
        draw_curves(_axes(figure, CURVES_BOX), picture)
        draw_features(_axes(figure, FEATURES_BOX), picture)
        draw_training(_axes(figure, TRAINING_BOX), picture)
        draw_recording(_axes(figure, RECORDING_BOX), picture)
        draw_observed_features(_axes(figure, OBSERVED_BOX), picture)
        posterior = _stack(figure, POSTERIOR_BOX)
        draw_posterior(posterior, picture)
        check = _axes(figure, CHECK_BOX)
        draw_check(check, picture)
        if not picture.support.supported:
            for axes in (*posterior, check):
                mark_excluded(axes)
        _write(figure, picture, cohort_title)
        _connect(figure, picture)
    return figure


def _write(figure: Figure, picture: WorkflowPicture, cohort_title: str) -> None:
    """Write the heads of both rows, the title of each panel, and the context."""
    copies = len(picture.sample_z)
    state = "" if picture.support.supported else " (excluded)"
    subject = _short(picture.subject)
    heads = {
        ROW_A: f"(a) Training: {picture.subjects} {cohort_title} pooled, here {subject}",
        ROW_B: f"(b) Inference: {subject}{state}",
    }
    for bottom, head in heads.items():
        y = bottom + PANEL_HEIGHT_IN + HEAD_ABOVE_IN
        _text(figure, 0.06, y, head, fontsize=7.0, fontweight="bold", ha="left")
    titles = {
        PRIOR_BOX: r"$\theta \sim p(\theta)$",
        CURVES_BOX: "$E_\\mathrm{sim}(s)$ (kPa)",
        FEATURES_BOX: rf"$z$, {copies} noisy copies",
        TRAINING_BOX: rf"{picture.estimator} $q_\eta(\theta\,|\,z)$",
        RECORDING_BOX: "$E_\\mathrm{obs}(s)$ (kPa)",
        OBSERVED_BOX: r"$z_\mathrm{obs}$",
        POSTERIOR_BOX: r"$q_\eta(\theta\,|\,z_\mathrm{obs})$",
        CHECK_BOX: "PPC (kPa)",
    }
    for box, title in titles.items():
        _text(figure, box.middle, box.bottom + box.height + TITLE_ABOVE_IN, title, fontsize=TITLE_PT)
    context = f"context $c_d$: {context_line(picture.context)}"
    _text(figure, 0.06, ROW_A - 0.30, context, fontsize=SMALL_PT, ha="left")


def _short(name: str) -> str:
    """Return a name that leaves room for what stands beside it."""
    return name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}…"


def _connect(figure: Figure, picture: WorkflowPicture) -> None:
    """Draw the arrows between neighbouring panels, and from the trained network to the posterior."""
    rows: Sequence[Sequence[tuple[Box, Box]]] = (
        ((PRIOR_BOX, CURVES_BOX), (CURVES_BOX, FEATURES_BOX), (FEATURES_BOX, TRAINING_BOX)),
        ((RECORDING_BOX, OBSERVED_BOX), (OBSERVED_BOX, POSTERIOR_BOX), (POSTERIOR_BOX, CHECK_BOX)),
    )
    summary = r"$S(\cdot)$, $c_d$"
    labels = (("0D model, $c_d$", summary, f"{picture.rows:,} rows"), (summary, "", "0D model"))
    for pairs, names in zip(rows, labels, strict=True):
        for (left, right), name in zip(pairs, names, strict=True):
            start, end = left.left + left.width, right.left
            y = left.bottom + left.height + ARROW_ABOVE_IN
            _arrow(figure, [(start, y), (end, y)])
            _text(figure, (start + end) / 2.0, y + 0.065, name, fontsize=SMALL_PT)
    _connect_network(figure)


def _connect_network(figure: Figure) -> None:
    """Draw the arrow from the trained network, down between the rows, to the posterior."""
    turn = ROW_B + PANEL_HEIGHT_IN + HEAD_ABOVE_IN
    corners = [
        (TRAINING_BOX.middle, ROW_A - 0.27),
        (TRAINING_BOX.middle, turn),
        (POSTERIOR_BOX.middle, turn),
        (POSTERIOR_BOX.middle, ROW_B + PANEL_HEIGHT_IN + TITLE_ABOVE_IN + 0.08),
    ]
    _arrow(figure, corners)
    _text(
        figure, (TRAINING_BOX.middle + POSTERIOR_BOX.middle) / 2.0, turn + 0.065, "trained", fontsize=SMALL_PT
    )


def _axes(figure: Figure, box: Box) -> Axes:
    axes = figure.add_axes(_fractions(box))
    axes.tick_params(labelsize=SMALL_PT, pad=1.2, length=1.8)
    return axes


def _stack(figure: Figure, box: Box) -> list[Axes]:
    """Return three low axes one above the other within a box, for three densities."""
    step = box.height / 3.0
    return [
        _axes(figure, Box(box.left, box.bottom + (2 - j) * step, box.width, 0.55 * step)) for j in range(3)
    ]


def _fractions(box: Box) -> tuple[float, float, float, float]:
    return (
        box.left / TEXT_WIDTH_IN,
        box.bottom / HEIGHT_IN,
        box.width / TEXT_WIDTH_IN,
        box.height / HEIGHT_IN,
    )


def _text(figure: Figure, x_in: float, y_in: float, text: str, **look: Any) -> None:  # noqa: ANN401
    if text:
        named = {"ha": "center", "va": "center", **look}
        figure.text(x_in / TEXT_WIDTH_IN, y_in / HEIGHT_IN, text, **named)


def _arrow(figure: Figure, corners_in: Sequence[tuple[float, float]]) -> None:
    """Draw an arrow along straight lines from corner to corner, in inches."""
    path = MplPath([(x / TEXT_WIDTH_IN, y / HEIGHT_IN) for x, y in corners_in])
    figure.add_artist(
        FancyArrowPatch(
            path=path,
            arrowstyle="-|>",
            mutation_scale=6.0,
            lw=0.8,
            color="black",
            transform=figure.transFigure,
        )
    )
