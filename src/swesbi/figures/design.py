"""What more repeats or more phases would buy: the expected width of the credible intervals."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, MaxNLocator, NullFormatter, NullLocator, ScalarFormatter
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from swesbi.figures.experiments import COLORS
from swesbi.figures.identifiability import QUANTITY_LABELS
from swesbi.figures.layout import shared_legend
from swesbi.figures.style import OBSERVED, PRIOR, TRUTH, new_figure, style
from swesbi.figures.text import percent, titled
from swesbi.identifiability.laplace import interval_fold
from swesbi.parameters import ATTAINED, THETA_NAMES

FloatArray = NDArray[np.float64]

SHOWN: Final = (*THETA_NAMES, ATTAINED)
WIDTH_IN: Final = 6.9
ROW_HEIGHT_IN: Final = 1.45
FRAME_HEIGHT_IN: Final = 1.35
MOST_NAMED: Final = 8
CONTOURS: Final = 7
SPREAD: Final = 0.12
FLOOR_LABEL: Final = "no noise: the model's errors alone"


def half_width(sd_log: FloatArray | xr.DataArray, mass: float) -> FloatArray:
    """Return by what percentage the upper end of the interval lies above the middle, in the logarithm."""
    return np.asarray(100.0 * (np.sqrt(interval_fold(np.asarray(sd_log), mass)) - 1.0))


def draw(groups: dict[str, xr.Dataset], cohort_title: str) -> Figure:
    """Draw, for each quantity, the width against repeats, against phases, and over both.

    Args:
        groups: Of ``identifiability.h5``: root, design, placement.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    mass, design = float(groups["/"]["interval_mass"]), groups["design"]
    repeats = _nearest(design["repeats"], float(design["own_repeats"].median()))
    phases = _nearest(design["phases"], float(groups["phases"].sizes["phase"]))
    with style():
        figure = new_figure(WIDTH_IN, FRAME_HEIGHT_IN + ROW_HEIGHT_IN * len(SHOWN))
        grid = figure.subplots(len(SHOWN), 3, sharex="col", squeeze=False, width_ratios=(1.0, 1.0, 1.0))
        for row, name in enumerate(SHOWN):
            of_one = {key: data.sel(quantity=name) for key, data in groups.items() if "quantity" in data.dims}
            _against_repeats(grid[row, 0], of_one, phases, mass)
            _against_phases(grid[row, 1], of_one, repeats, mass)
            _over_both(grid[row, 2], of_one["design"], repeats * phases, mass)
            grid[row, 1].sharey(grid[row, 0])
            grid[row, 0].set_ylabel(f"{QUANTITY_LABELS[name]}\n± (%)")
            grid[row, 2].set_ylabel("phases")
        _finish(grid, phases, repeats, mass)
        figure.suptitle(
            titled(f"Expected half-width of the {percent(mass)} credible interval", cohort_title),
            fontsize=7.5,
        )
        shared_legend(figure, list(grid[:, :2].flat), entries_a_row=4)
    return figure


def _nearest(values: xr.DataArray, wanted: float) -> int:
    return int(values.to_numpy()[np.argmin(np.abs(values.to_numpy() - wanted))])


def _against_repeats(axes: Axes, of_one: dict[str, xr.Dataset], phases: int, mass: float) -> None:
    design, repeats = of_one["design"].sel(phases=phases), of_one["design"]["repeats"].to_numpy()
    _draw_subjects(axes, repeats, design["sd_log"], mass)
    axes.plot(
        repeats,
        half_width(design["sd_log"].median("subject"), mass),
        color=OBSERVED,
        lw=1.6,
        label="median subject",
    )
    floor = float(half_width(design["floor"].median("subject"), mass))
    axes.axhline(floor, color=OBSERVED, lw=0.9, ls="--", label=FLOOR_LABEL)
    found = half_width(of_one["/"]["sd_log"], mass)
    for index, (at, value) in enumerate(zip(design["own_repeats"].to_numpy(), found, strict=True)):
        beside = at + SPREAD * (index - 0.5 * (len(found) - 1)) if len(found) <= MOST_NAMED else at
        axes.plot(
            beside, value, "o", color=_color(index, len(found)), ms=3.0, mew=0.5, mec="white", zorder=5,
            label="posterior found" if index == 0 else None,
        )  # fmt: skip


def _against_phases(axes: Axes, of_one: dict[str, xr.Dataset], repeats: int, mass: float) -> None:
    design, phases = of_one["design"].sel(repeats=repeats), of_one["design"]["phases"].to_numpy()
    _draw_subjects(axes, phases, design["sd_log"], mass)
    lines: dict[str, tuple[FloatArray, xr.DataArray, dict[str, Any]]] = {
        "median subject": (phases, design["sd_log"], {"color": OBSERVED, "lw": 1.6}),
        "model errors independent however near": (
            phases, design["sd_log_independent"], {"color": OBSERVED, "lw": 0.9, "ls": ":"},
        ),
        "phases chosen for the cohort": (
            of_one["placement"]["placed"].to_numpy(),
            of_one["placement"]["sd_log"],
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
        axes.plot(
            x,
            half_width(sd_log.isel(subject=index), mass),
            color=_color(index, len(names)),
            lw=0.7,
            label=label,
        )


def _color(index: int, subjects: int) -> str:
    return COLORS[index % (len(COLORS) - 1)] if subjects <= MOST_NAMED else PRIOR


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
    titles = (
        f"{phases} phases",
        f"{repeats} repeats",
        f"median; dash-dotted: {phases * repeats} pushes",
    )
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
