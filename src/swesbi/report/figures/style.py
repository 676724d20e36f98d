"""One look for every figure: panels, curves over the cycle, and files the same whenever they are made."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, SubFigure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from matplotlib.transforms import Bbox

from swesbi.artefacts import atomic_path
from swesbi.base.arrays import FloatArray
from swesbi.checks.scores import Band
from swesbi.verdict.verdict import Status, Verdict

TEXT_WIDTH_IN: Final = 12.2 / 2.54
"""Text width of Springer's LNCS class, in inches."""
WIDE_IN: Final = 1.45 * TEXT_WIDTH_IN
"""Of figures that only pages show."""

OBSERVED: Final = "#000000"
TRUTH: Final = "#009E73"
PRIOR: Final = "#8C8C8C"
POSTERIOR: Final = "#0072B2"
NETWORK: Final = "#6A1B9A"
CMAES: Final = "#D55E00"
DOUBTFUL: Final = "#B07000"
EXCLUDED_POSTERIOR: Final = "#4D5B66"
EXCLUDED_BACKGROUND: Final = "#EDEDED"
ACCEPTED_COLOR: Final = "#737373"
REFUSED_COLOR: Final = "#BDBDBD"
STATUS_COLORS: Final[dict[str, str]] = {
    Status.NOT_CONTRADICTED: POSTERIOR,
    Status.UNINFORMATIVE: "#557590",
    Status.DOUBTFUL: DOUBTFUL,
    Status.CONTRADICTED: EXCLUDED_POSTERIOR,
}
"""Of what is judged: each verdict has one colour, in figures, on pages and on sheets."""
SERIES: Final = (
    "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8B4513", "#6A1B9A", "#B22222"
)  # fmt: skip
"""Of groups, reasons and the like, which have no colour of their own; told apart by the colour-blind."""

RC: Final[Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 7.0,
    "axes.titlesize": 7.0,
    "axes.labelsize": 7.0,
    "xtick.labelsize": 6.5,
    "ytick.labelsize": 6.5,
    "legend.fontsize": 6.5,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "xtick.minor.size": 1.5,
    "ytick.minor.size": 1.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "lines.linewidth": 1.1,
    "pdf.fonttype": 42,
    "mathtext.fontset": "dejavusans",
}

PHASE: Final = "phase of the cardiac cycle, from the R peak"
INSTANT: Final = "instant of the push in its own beat, from the R peak"
STIFFNESS: Final = "stiffness $E = 3\\rho c_s^2$ (kPa)"
SPEED: Final = "shear-wave speed (m/s)"
HEAD_ROOM: Final = 1.08

MAX_PIXELS: Final = 30_000
"""Longest side of an image: a cohort of hundreds keeps within what image libraries open."""
PLACES: Final = 2**20
"""Panels stand at multiples of this fraction of a figure: less than a thirtieth of a pixel of the largest."""
FEWEST_TICKS: Final = 3
COLUMNS: Final = {1: 1, 2: 2, 3: 3, 4: 2, 5: 3, 6: 3, 9: 3}
"""Of a grid of so many panels, where not four or five."""
NO_TIMESTAMP: Final = {".pdf": {"CreationDate": None, "ModDate": None}, ".png": {"Software": None}}


@contextmanager
def style() -> Iterator[None]:
    """Draw in the study's style, from matplotlib's own defaults whatever the user's matplotlibrc says."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(RC)
        yield


class SameTwiceLayout(ConstrainedLayoutEngine):
    """Constrained layout whose panels stand at the same place in every process.

    The solver that matplotlib uses adds its terms in the order of their addresses in memory, so places differ
    in the last bits from one process to the next, and now and then a digit of a PDF does.
    """

    def execute(self, fig: Figure) -> None:
        """Lay the figure out, and round where its panels stand."""
        super().execute(fig)
        for axes in fig.axes:
            inside = axes.get_in_layout()
            axes.set_position(Bbox(_rounded(axes.get_position(original=True))))
            axes.set_in_layout(inside)  # a place that is set would else be left out of the next layout
        parts = list(fig.subfigs)
        for part in parts:
            part.bbox_relative.set_points(_rounded(part.bbox_relative))
            parts.extend(part.subfigs)


def _rounded(box: Bbox) -> FloatArray:
    return np.asarray(np.round(box.get_points() * PLACES) / PLACES)


@contextmanager
def drawing(
    width_in: float, height_in: float, title: str = "", size: float | str = 7.5, *, fixed: bool = False
) -> Iterator[Figure]:
    """Draw a figure in the study's style, with its title above; without one it has no room for it.

    Its constrained layout keeps text apart, unless all of its parts have ``fixed`` places.
    """
    with style():
        figure = Figure(figsize=(width_in, height_in), layout=None if fixed else SameTwiceLayout())
        FigureCanvasAgg(figure)
        if title:
            figure.suptitle(title, fontsize=size)
        yield figure


def save_figure(figure: Figure, *paths: Path) -> None:
    """Write a figure as PDF (embedded TrueType fonts) or PNG, by suffix, without a timestamp."""
    for path in paths:
        if path.suffix not in NO_TIMESTAMP:
            raise ValueError(f"{path}: figures are written as .pdf or .png, not {path.suffix!r}")
        with style(), atomic_path(path) as temporary:
            if (layout := figure.get_layout_engine()) is not None:
                layout.execute(figure)
                figure.set_layout_engine(None)  # else each file is laid out anew, and drawn twice for that
            dpi = min(300, MAX_PIXELS / max(figure.get_size_inches()))
            figure.savefig(temporary, dpi=dpi, metadata=NO_TIMESTAMP[path.suffix])


class Saved:
    """The format of a figure."""

    def write(self, figure: Figure, path: Path) -> None:
        """Write a figure as :func:`save_figure` does."""
        save_figure(figure, path)


Drawing = Annotated[Figure, Saved()]
"""A figure that is a file, or one of each suffix."""


def columns(panels: int) -> int:
    """Return how many columns a grid of panels gets: few and wide for small cohorts, at most five."""
    return COLUMNS.get(panels, 4 if panels <= 24 else 5)


def rows(panels: int) -> int:
    """Return how many rows the grid needs."""
    return math.ceil(panels / columns(panels))


def panel_grid(
    figure: Figure | SubFigure, panels: int, across: int | None = None, *, sharex: bool = True
) -> list[Axes]:
    """Return one axes a panel, row by row, with common scales; what is left of the last row stays empty."""
    across = across or columns(panels)
    grid = figure.subplots(math.ceil(panels / across), across, sharex=sharex, sharey=True, squeeze=False)
    axes = list(grid.flat)
    for spare in axes[panels:]:
        spare.remove()
    for shown in axes[:panels]:
        shown.tick_params(labelbottom=True)  # rows stand evenly, whichever is a column's last
    return axes[:panels]


def color_of(verdict: Verdict) -> str:
    """Return the colour of a verdict; the paper's criteria have those of what may be read, or not."""
    return STATUS_COLORS.get(verdict.status, POSTERIOR if verdict.may_be_read else EXCLUDED_POSTERIOR)


def shared_legend(figure: Figure, axes: Sequence[Axes], entries_a_row: int) -> None:
    """Put one legend below all panels, each label once."""
    handles: dict[str, Artist] = {}
    for panel in axes:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    figure.legend(
        list(handles.values()),
        list(handles),
        loc="outside lower center",
        ncols=entries_a_row,
        columnspacing=1.2,
        handlelength=1.8,
    )


def draw_band(
    axes: Axes, phase: FloatArray, band: Band, color: str, label: str = "", *, line: str = "-"
) -> None:
    """Draw a median within its interval at every point of the cycle, with one entry of the legend."""
    axes.plot(phase, band.median, line, color=color)
    axes.fill_between(phase, band.low, band.high, color=color, alpha=0.25, lw=0, label=label)


def draw_points(
    axes: Axes,
    phase: FloatArray,
    value: FloatArray,
    se: FloatArray,
    label: str = "",
    *,
    color: str = OBSERVED,
) -> None:
    """Draw measured points with their standard errors; a point that was not measured is NaN and left out.

    A gated recording has phases that many beats share, a free-running one single pushes.
    """
    shown = np.isfinite(value)
    axes.errorbar(
        phase[shown],
        value[shown],
        se[shown],
        fmt="o",
        ms=2.2,
        elinewidth=0.8,
        zorder=4,
        color=color,
        label=label,
    )


def cycle_axis(axes: Axes, label: str = PHASE) -> None:
    """Let x be one cardiac cycle."""
    axes.set_xlim(0.0, 1.0)
    axes.set_xticks([0.0, 0.25, 0.5, 0.75, 1.0], ["0", "0.25", "0.5", "0.75", "1"])
    axes.set_xlabel(label)


def from_zero(axes: Axes, *values: FloatArray) -> None:
    """Let y begin at 0 and hold all of the values, NaN left out."""
    axes.set_ylim(0.0, HEAD_ROOM * max(float(np.nanmax(each)) for each in values if np.isfinite(each).any()))


class PlainDecades(LogLocator):
    """Ticks of a logarithmic axis: decades, and what lies between where these are fewer than three."""

    def tick_values(self, vmin: float, vmax: float) -> list[float]:
        """Return the ticks of a view."""
        decades = 10.0 ** np.arange(math.floor(math.log10(vmin)), math.ceil(math.log10(vmax)) + 1)
        for within in ([1.0], [1.0, 2.0, 5.0], [1.0, 1.5, 2.0, 3.0, 5.0, 7.0]):
            ticks = np.outer(decades, within).ravel()
            ticks = ticks[(ticks >= vmin) & (ticks <= vmax)]
            if len(ticks) >= FEWEST_TICKS:
                return [float(tick) for tick in ticks]
        return [float(tick) for tick in few_ticks().tick_values(vmin, vmax)]


def few_ticks(*, integer: bool = False) -> MaxNLocator:
    """Return ticks of a plain axis: three to five, at round numbers."""
    return MaxNLocator(4, min_n_ticks=FEWEST_TICKS, steps=[1, 2, 2.5, 4, 5, 10], integer=integer)


def plain_decades(axis: Axis) -> None:
    """Make an axis logarithmic, marked in plain numbers, three or more."""
    axes = axis.axes
    (axes.set_xscale if axis is axes.xaxis else axes.set_yscale)("log")
    axis.set_major_locator(PlainDecades())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def in_percent(axis: Axis) -> None:
    """Show fractions along an axis in percent, with decimals where whole percents would repeat."""
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{100.0 * value:.4g} %".replace("-", "−")))


def titled(what: str, cohort_title: str) -> str:
    """Return a figure's title, which says whose data it shows."""
    return f"{what}: {plain(cohort_title)}"


def plain(text: str) -> str:
    """Return a name, or what else others wrote, so that a figure shows it as it is.

    matplotlib takes dollar signs for mathematics, and a legend leaves out what begins with an underscore.
    """
    shown = text.replace("$", r"\$")
    return f" {shown}" if shown.startswith("_") else shown
