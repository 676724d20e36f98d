"""What the recordings tell, phase by phase, and what more repeats or phases would buy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, PowerNorm
from matplotlib.figure import SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.stats import chi2

from swesbi.checks.identifiability.tables import Identifiability
from swesbi.heart.model import isometric_share, isometric_stiffness_kpa
from swesbi.parameters import ISOMETRIC, ISOMETRIC_SYMBOL, K_0, K_ATP, PHI_SYMBOLS, THETA_LABELS
from swesbi.report.figures.style import (
    CMAES,
    EXCLUDED_BACKGROUND,
    OBSERVED,
    PRIOR,
    TEXT_WIDTH_IN,
    Drawing,
    columns,
    label_outer,
    new_figure,
    panel_grid,
    plain_decades,
    rows,
    style,
    titled,
)
from swesbi.report.numbers import as_percent

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

QUANTITY_LABELS: Final = {**PHI_SYMBOLS, ISOMETRIC: ISOMETRIC_SYMBOL}
REGION_COLORS: Final = ("#0072B2", "#5BA3D0", "#B3D4EA", "#DDEBF5")
PANEL_HEIGHT_IN: Final = 1.35
FRAME_HEIGHT_IN: Final = 1.5
MARGIN: Final = 1.15
NARROW: Final = 2.5  # upper over lower end of an axis that holds fewer than two of the marks 1, 2 and 5
FINE_POINTS: Final = 100
TOP_INCREASE: Final = 0.6  # the end of the colour scale: a phase without which the sd grows by 60 %
DOT_AREA: Final = 30.0  # points^2 at the end of the colour scale


def draw_identifiability(identifiability: Identifiability, *, cohort_title: str) -> Drawing:
    """Draw a profile and a heat map for each subject.

    Args:
        identifiability: The study of a cohort.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    groups = identifiability.datasets
    names = [str(name) for name in groups["/"]["subject"].to_numpy()]
    with style():
        height = FRAME_HEIGHT_IN + 2.0 * PANEL_HEIGHT_IN * rows(len(names))
        figure = new_figure(max(TEXT_WIDTH_IN, 1.9 * columns(len(names))), height)
        grid = figure.add_gridspec(2, 1)
        above, below = figure.add_subfigure(grid[0]), figure.add_subfigure(grid[1])
        _draw_profiles(above, groups, names)
        _draw_phases(below, groups["phases"], names)
        figure.suptitle(titled("What the recordings tell", cohort_title), fontsize=7.5)
    return figure


def _draw_profiles(figure: SubFigure, groups: Mapping[str, xr.Dataset], names: list[str]) -> None:
    panels, profile = panel_grid(figure, len(names)), groups["profile"]
    levels = profile["confidence_level"].to_numpy()
    for index, (axes, name) in enumerate(zip(panels, names, strict=True)):
        draws = groups["/"]["shown_phi"].isel(subject=index).to_numpy()
        axes.plot(draws[:, 1], draws[:, 0], ".", color=OBSERVED, ms=1.0, alpha=0.35, mew=0.0, zorder=3)
        _draw_region(axes, profile.isel(subject=index), levels)
        axes.set_title(name, pad=2.0)
    x_limits, y_limits = _limits(groups, levels)
    for axes in panels:
        _log_axes(axes, x_limits, y_limits)
    for first in panels[:: columns(len(names))]:
        first.set_ylabel(THETA_LABELS[K_0])
    label_outer(panels, THETA_LABELS[K_ATP])
    figure.suptitle("Profile likelihood along $k_0$ and $k_\\mathrm{ATP}$", fontsize=7.0)
    _profile_legend(figure, levels)


def _draw_region(axes: Axes, profile: xr.Dataset, levels: FloatArray) -> None:
    k_0, k_atp = profile["k0_kpa"].to_numpy(), profile["k_atp_per_s"].to_numpy()
    drops = [0.0, *chi2.ppf(levels, 2)]
    # Of a normal likelihood the root of the deviance is linear on either side: few points make it smooth.
    root = np.sqrt(np.maximum(profile["pair_deviance"].to_numpy(), 0.0))
    fine_k_0, fine_k_atp = (np.geomspace(axis[0], axis[-1], FINE_POINTS) for axis in (k_0, k_atp))
    by_k_0 = PchipInterpolator(np.log(k_0), root, axis=0)(np.log(fine_k_0))
    fine = PchipInterpolator(np.log(k_atp), by_k_0, axis=1)(np.log(fine_k_atp)) ** 2
    axes.contourf(fine_k_atp, fine_k_0, fine, levels=drops, colors=REGION_COLORS[: len(levels)])
    best, duration_s = profile["maximum_phi"].to_numpy(), float(profile["activation_duration_s"])
    along = np.geomspace(*axes_range(k_atp), 100)
    isometric = isometric_stiffness_kpa(best[None], duration_s)
    axes.plot(along, isometric / isometric_share(along, duration_s), "--", color=CMAES, lw=0.8, zorder=2)
    axes.plot(best[1], best[0], "+", color=CMAES, ms=5.0, mew=1.0, zorder=4, clip_on=False)


def axes_range(values: FloatArray) -> tuple[float, float]:
    """Return the ends of ascending values, a margin further."""
    return float(values[0]) / MARGIN, float(values[-1]) * MARGIN


def _limits(
    groups: Mapping[str, xr.Dataset], levels: FloatArray
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return common limits of k_ATP and of k_0: every subject's widest region."""
    profile = groups["profile"]
    inside = (profile["pair_deviance"] <= chi2.ppf(levels.max(), 2)).to_numpy()
    shape = inside.shape
    k_0 = np.broadcast_to(profile["k0_kpa"].to_numpy()[:, :, None], shape)[inside]
    k_atp = np.broadcast_to(profile["k_atp_per_s"].to_numpy()[:, None, :], shape)[inside]
    return axes_range(np.sort(k_atp)), axes_range(np.sort(k_0))


def _log_axes(axes: Axes, x_limits: tuple[float, float], y_limits: tuple[float, float]) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(x_limits)
    axes.set_ylim(y_limits)
    for axis in (axes.xaxis, axes.yaxis):
        plain_decades(axis)
        if np.divide(*axis.get_view_interval()[::-1]) < NARROW:
            axis.set_major_locator(MaxNLocator(4))


def _profile_legend(figure: SubFigure, levels: FloatArray) -> None:
    regions = [
        Patch(color=color, label=f"{as_percent(float(level))} region")
        for level, color in zip(levels, REGION_COLORS, strict=False)
    ]
    marks = [
        Line2D([], [], color=CMAES, marker="+", ls="none", label="maximum"),
        Line2D([], [], color=CMAES, ls="--", lw=0.8, label="equal " + ISOMETRIC_SYMBOL),
        Line2D([], [], color=OBSERVED, marker=".", ls="none", ms=3.0, label="posterior draws"),
    ]
    figure.legend(handles=[*regions, *marks], loc="outside lower center", ncols=3, columnspacing=1.2)


def _draw_phases(figure: SubFigure, phases: xr.Dataset, names: list[str]) -> None:
    panels = panel_grid(figure, len(names))
    norm, colors = PowerNorm(0.5, 0.0, 100.0 * TOP_INCREASE), ListedColormap(_greens())
    for index, (axes, name) in enumerate(zip(panels, names, strict=True)):
        _draw_heat_map(axes, phases.isel(subject=index), norm, colors)
        axes.set_title(name, pad=2.0)
    labels = [QUANTITY_LABELS[str(name)] for name in phases["quantity"].to_numpy()]
    for first in panels[:: columns(len(names))]:
        first.set_yticks(range(len(labels)), labels)
    label_outer(panels, "phase (fraction of the cycle)")
    bar = figure.colorbar(ScalarMappable(norm, colors), ax=panels, extend="max", aspect=30, pad=0.01)
    bar.set_label("growth of the sd (%)")
    figure.suptitle(
        "Which phase informs what: growth of the posterior sd without it,\n"
        "expected (colour) and found by reweighting (circles, by area); grey: not measured",
        fontsize=6.5,
    )


def _greens() -> FloatArray:
    """Return white to dark green, readable in print."""
    share = np.linspace(0.0, 1.0, 256)[:, None]
    return np.asarray((1.0 - share) * np.array([1.0, 1.0, 1.0]) + share * np.array([0.0, 0.30, 0.22]))


def _draw_heat_map(axes: Axes, phases: xr.Dataset, norm: PowerNorm, colors: ListedColormap) -> None:
    expected = 100.0 * phases["expected_sd_increase"].to_numpy()
    left_out = phases["left_out_sd_increase"].to_numpy()
    phase = phases["phase_of"].to_numpy()
    between = 0.5 * (phase[1:] + phase[:-1])
    edges = np.concatenate([[0.0], between, [1.0]])
    axes.set_facecolor(EXCLUDED_BACKGROUND if np.isnan(expected).any() else "white")
    axes.pcolormesh(
        edges, np.arange(len(expected) + 1) - 0.5, np.ma.masked_invalid(expected), norm=norm, cmap=colors
    )
    x, y = np.meshgrid(phase, np.arange(len(expected)))
    shown = np.nan_to_num(left_out) > 0.02
    area = DOT_AREA * np.minimum(left_out[shown] / TOP_INCREASE, 1.5)
    axes.scatter(x[shown], y[shown], s=area, facecolors="none", edgecolors=CMAES, linewidths=0.7)
    axes.set_xlim(0.0, 1.0)
    axes.set_xticks([0.0, 0.25, 0.5, 0.75, 1.0], ["0", "", "0.5", "", "1"])
    axes.set_ylim(len(expected) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)
    for row in range(1, len(expected)):
        axes.axhline(row - 0.5, color=PRIOR, lw=0.3)
