"""What the recordings tell, phase by phase, and what more repeats or phases would buy."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, PowerNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, MaxNLocator, NullFormatter, NullLocator, ScalarFormatter
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator, RegularGridInterpolator
from scipy.stats import chi2

from swesbi.checks.identifiability.information import interval_fold
from swesbi.heart.model import isometric_share, isometric_stiffness_kpa
from swesbi.parameters import ISOMETRIC, ISOMETRIC_SYMBOL, K_0, K_ATP, PHI_SYMBOLS, THETA_LABELS, THETA_NAMES
from swesbi.report.figures.experiments import COLORS
from swesbi.report.figures.style import (
    CMAES,
    EXCLUDED_BACKGROUND,
    OBSERVED,
    PRIOR,
    TEXT_WIDTH_IN,
    TRUTH,
    columns,
    label_outer,
    new_figure,
    panel_grid,
    plain_decades,
    rows,
    shared_legend,
    style,
    titled,
)
from swesbi.report.numbers import as_percent

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
SHOWN: Final = (*THETA_NAMES, ISOMETRIC)
WIDTH_IN: Final = 6.9
ROW_HEIGHT_IN: Final = 1.45
DESIGN_FRAME_HEIGHT_IN: Final = 1.35
MOST_NAMED: Final = 8
OWN_COLORS: Final = len(COLORS) - 1  # the last is that of the median subject
CONTOURS: Final = 7
SPREAD: Final = 0.12
FLOOR_LABEL: Final = "no noise: the model's errors alone"


def draw_identifiability(groups: dict[str, xr.Dataset], cohort_title: str) -> Figure:
    """Draw a profile and a heat map for each subject.

    Args:
        groups: Of ``identifiability.h5``: root, profile, phases.
        cohort_title: What the subjects are ("virtual volunteers").
    """
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


def _draw_profiles(figure: SubFigure, groups: dict[str, xr.Dataset], names: list[str]) -> None:
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
    groups: dict[str, xr.Dataset], levels: FloatArray
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


def half_width(sd_log: FloatArray | xr.DataArray, mass: float) -> FloatArray:
    """Return by what percentage the upper end of the interval lies above the middle, in the logarithm."""
    return np.asarray(100.0 * (np.sqrt(interval_fold(np.asarray(sd_log), mass)) - 1.0))


def draw_design(groups: dict[str, xr.Dataset], cohort_title: str) -> Figure:
    """Draw, for each quantity, the width against repeats, against phases, and over both.

    Args:
        groups: Of ``identifiability.h5``: root, design, placement.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    mass, design = float(groups["/"]["interval_mass"]), groups["design"]
    repeats = _nearest(design["repeats"], float(design["own_repeats"].median()))
    phases = _nearest(design["phases"], float(groups["phases"].sizes["phase"]))
    with style():
        figure = new_figure(WIDTH_IN, DESIGN_FRAME_HEIGHT_IN + ROW_HEIGHT_IN * len(SHOWN))
        grid = figure.subplots(len(SHOWN), 3, sharex="col", squeeze=False, width_ratios=(1.0, 1.0, 1.0))
        for row, name in enumerate(SHOWN):
            groups_of_quantity = {
                key: data.sel(quantity=name) for key, data in groups.items() if "quantity" in data.dims
            }
            _against_repeats(grid[row, 0], groups_of_quantity, phases, mass)
            _against_phases(grid[row, 1], groups_of_quantity, repeats, mass)
            _over_both(grid[row, 2], groups_of_quantity["design"], repeats * phases, mass)
            grid[row, 1].sharey(grid[row, 0])
            grid[row, 0].set_ylabel(f"{QUANTITY_LABELS[name]}\n± (%)")
            grid[row, 2].set_ylabel("phases")
        _finish(grid, phases, repeats, mass)
        figure.suptitle(
            titled(f"Expected half-width of the {as_percent(mass)} credible interval", cohort_title),
            fontsize=7.5,
        )
        shared_legend(figure, list(grid[:, :2].flat), entries_a_row=4)
    return figure


def _nearest(values: xr.DataArray, wanted: float) -> int:
    return int(values.to_numpy()[np.argmin(np.abs(values.to_numpy() - wanted))])


def _against_repeats(axes: Axes, groups: dict[str, xr.Dataset], phases: int, mass: float) -> None:
    design, repeats = groups["design"].sel(phases=phases), groups["design"]["repeats"].to_numpy()
    _draw_subjects(axes, repeats, design["sd_log"], mass)
    median = half_width(design["sd_log"].median("subject"), mass)
    axes.plot(repeats, median, color=OBSERVED, lw=1.6, label="median subject")
    floor = float(half_width(design["floor"].median("subject"), mass))
    axes.axhline(floor, color=OBSERVED, lw=0.9, ls="--", label=FLOOR_LABEL)
    half_widths = half_width(groups["/"]["sd_log"], mass)
    for index, (at, value) in enumerate(zip(design["own_repeats"].to_numpy(), half_widths, strict=True)):
        beside = (
            at + SPREAD * (index - 0.5 * (len(half_widths) - 1)) if len(half_widths) <= MOST_NAMED else at
        )
        axes.plot(
            beside, value, "os"[_again(index)], color=_color(index, len(half_widths)), ms=3.0, mew=0.5,
            mec="white", zorder=5, label="posterior found" if index == 0 else None,
        )  # fmt: skip


def _against_phases(axes: Axes, groups: dict[str, xr.Dataset], repeats: int, mass: float) -> None:
    design, phases = groups["design"].sel(repeats=repeats), groups["design"]["phases"].to_numpy()
    _draw_subjects(axes, phases, design["sd_log"], mass)
    lines: dict[str, tuple[FloatArray, xr.DataArray, dict[str, Any]]] = {
        "median subject": (phases, design["sd_log"], {"color": OBSERVED, "lw": 1.6}),
        "model errors independent however near": (
            phases, design["sd_log_independent"], {"color": OBSERVED, "lw": 0.9, "ls": ":"},
        ),
        "phases chosen for the cohort": (
            groups["placement"]["placed"].to_numpy(),
            groups["placement"]["sd_log"],
            {"color": TRUTH, "lw": 1.0, "marker": "^", "ms": 3.0},
        ),
    }  # fmt: skip
    for label, (x, sd_log, how) in lines.items():
        axes.plot(x, half_width(sd_log.median("subject"), mass), label=label, **how)
    floor = half_width(design["floor"].median("subject"), mass)
    axes.plot(phases, floor, color=OBSERVED, lw=0.9, ls="--", label=FLOOR_LABEL)


def _draw_subjects(axes: Axes, x: NDArray[np.int64], sd_log: xr.DataArray, mass: float) -> None:
    names = [str(name) for name in sd_log["subject"].to_numpy()]
    for index, name in enumerate(names):
        label = name if len(names) <= MOST_NAMED else "single subjects"
        width = half_width(sd_log.isel(subject=index), mass)
        line = "-." if len(names) <= MOST_NAMED and _again(index) else "-"
        axes.plot(x, width, color=_color(index, len(names)), lw=0.7, ls=line, label=label)


def _color(index: int, subjects: int) -> str:
    return COLORS[index % OWN_COLORS] if subjects <= MOST_NAMED else PRIOR


def _again(index: int) -> bool:
    """Tell whether a subject's colour is another's as well, from which its line and mark must tell it."""
    return index >= OWN_COLORS


def _over_both(axes: Axes, design: xr.Dataset, acquisitions: int, mass: float) -> None:
    """Draw the median subject's width over repeats and phases, and where the effort stays the same."""
    repeats, phases = design["repeats"].to_numpy(), design["phases"].to_numpy()
    width = half_width(design["sd_log"].median("subject").transpose("phases", "repeats"), mass)
    if len(repeats) > 1 and len(phases) > 1:
        axes.contourf(repeats, phases, width, levels=CONTOURS, cmap="viridis_r", alpha=0.55)
        lines = axes.contour(repeats, phases, width, levels=CONTOURS, colors="black", linewidths=0.5)
        axes.clabel(lines, fmt="%g", fontsize=5.5, manual=_label_places(lines.levels, repeats, phases, width))
    ends = np.array([repeats[0], repeats[-1]])
    axes.plot(ends, acquisitions / ends, color="white", lw=1.6)
    axes.plot(ends, acquisitions / ends, color=OBSERVED, lw=0.8, ls="-.")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(repeats[0], repeats[-1])
    axes.set_ylim(phases[0], phases[-1])
    for axis, ticks in ((axes.xaxis, (1, 2, 3, 5, 8, 12)), (axes.yaxis, (8, 10, 15, 20, 30, 40, 60))):
        axis.set_major_locator(FixedLocator(ticks))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(ScalarFormatter())


def _label_places(
    levels: Iterable[float], repeats: FloatArray, phases: FloatArray, width: FloatArray
) -> list[tuple[float, float]]:
    """Return where contours cross the way from the smallest to the largest design, not near its ends."""
    x, y = (np.geomspace(values[0], values[-1], 200) for values in (repeats, phases))
    along = RegularGridInterpolator((np.log(phases), np.log(repeats)), width)(np.log(np.column_stack([y, x])))
    crossing = [int(np.argmin(np.abs(along - level))) for level in levels]
    return [(float(x[at]), float(y[at])) for at in crossing if 0.04 < at / len(x) < 0.96]


def _finish(grid: NDArray[np.object_], phases: int, repeats: int, mass: float) -> None:
    titles = (f"{phases} phases", f"{repeats} repeats", f"median; dash-dotted: {phases * repeats} pushes")
    for axes, title in zip(grid[0], titles, strict=True):
        axes.set_title(title, fontsize=6.5, pad=3.0)
    for axes, label in zip(grid[-1], ("repeats", "phases", "repeats"), strict=True):
        axes.set_xlabel(label)
    for axes in grid[:, 0]:
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(FixedLocator([2, 3, 5, 7, 10, 15, 20, 30, 50, 70, 100]))
        axes.yaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_major_formatter(ScalarFormatter())
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    for axes in grid[:, 1]:
        axes.yaxis.set_minor_formatter(NullFormatter())
