"""The figure of the landing page: a panel for each parameter, an interval for each subject.

It is drawn as SVG inside the page, so that its letters stay legible on a phone and its colours follow the
reader's light or dark page, which a file of matplotlib cannot.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from markupsafe import Markup, escape
from matplotlib.ticker import MaxNLocator

from swesbi.report.numbers import SYMBOL, significant, span

WIDTH: Final = 340.0
"""Of a panel, in its own units: about the pixels of a phone."""
LEFT: Final = 30.0
RIGHT: Final = 12.0
TOP: Final = 8.0
ROW: Final = 22.0
AXIS: Final = 26.0
TICKS: Final = 5


@dataclass(frozen=True)
class Interval:
    """Median and credible interval of one subject, in the parameter's unit; NaN where it is not answered."""

    subject: str
    status: str
    median: float
    low: float
    high: float


@dataclass(frozen=True)
class Mark:
    """One subject's row of a panel, in the panel's units."""

    subject: str
    status: str
    y: float
    low: float
    median: float
    high: float


@dataclass(frozen=True)
class Panel:
    """One parameter: its marks and the ticks of its axis (place, text), and the same in words."""

    symbol: str
    unit: str
    width: float
    height: float
    bottom: float
    left: float
    right: float
    marks: tuple[Mark, ...]
    ticks: tuple[tuple[float, str], ...]
    description: str


def panel(symbol: str, unit: str, intervals: Sequence[Interval]) -> Panel:
    """Place a parameter's intervals from zero on, those without an answer left out."""
    known = [each for each in intervals if not math.isnan(each.median)]
    end = max((each.high for each in known), default=1.0)
    ticks = [float(value) for value in MaxNLocator(TICKS).tick_values(0.0, end) if value >= 0.0]
    scale = (WIDTH - LEFT - RIGHT) / ticks[-1]
    marks = tuple(_mark(each, row, scale) for row, each in enumerate(known))
    bottom = TOP + ROW * len(known)
    said = f"{symbol} in {unit}: {'; '.join(map(_in_words, known))}"
    places = tuple((round(LEFT + scale * value, 1), f"{value:g}") for value in ticks)
    return Panel(
        symbol,
        unit,
        WIDTH,
        bottom + AXIS,
        bottom,
        LEFT,
        WIDTH - RIGHT,
        marks,
        places,
        said,
    )


def _mark(each: Interval, row: int, scale: float) -> Mark:
    low, median, high = (round(LEFT + scale * value, 1) for value in (each.low, each.median, each.high))
    return Mark(each.subject, each.status, TOP + ROW * (row + 0.5), low, median, high)


def _in_words(each: Interval) -> str:
    limits = span(significant(each.low), significant(each.high))
    return f"{each.subject} {significant(each.median)} ({limits})"


def svg_symbols(text: str) -> Markup:
    """Return plain text as content of an SVG text, with k_0, k_ATP, k_SR and D_T set as symbols."""
    lowered = r'<tspan font-size="10" dy="3">\2</tspan><tspan dy="-3">&#8203;</tspan>'
    symbol = rf'<tspan font-style="italic">\1</tspan>{lowered}'
    return Markup(SYMBOL.sub(symbol, str(escape(text))))
