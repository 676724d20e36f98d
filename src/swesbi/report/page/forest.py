"""The figure of the landing page: a panel for each parameter, an interval for each subject.

It is drawn as SVG inside the page, so that its letters stay legible on a phone and its colours follow the
reader's light or dark page, which a file of matplotlib cannot.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import pandas as pd
from markupsafe import Markup, escape
from matplotlib.ticker import MaxNLocator

from swesbi.report.numbers import SYMBOL, significant, span
from swesbi.report.results import records

WIDTH: Final = 340.0
"""Of a panel, in its own units: about the pixels of a phone."""
LEFT: Final = 30.0
RIGHT: Final = 12.0
TOP: Final = 8.0
ROW: Final = 22.0
AXIS: Final = 26.0


def panel(symbol: str, unit: str, answers: pd.DataFrame) -> Mapping[str, Any]:
    """Return a parameter for the template: intervals from zero on, those without an answer left out.

    There are a mark for each subject, the ticks (place, text), and the same in words. ``answers`` has the
    columns ``subject``, ``status``, ``median``, ``low`` and ``high``, in that unit.
    """
    known = answers.dropna(subset="median")
    end = known["high"].max() if len(known) else 1.0
    ticks = [float(value) for value in MaxNLocator(5).tick_values(0.0, end) if value >= 0.0]
    scale = (WIDTH - LEFT - RIGHT) / ticks[-1]
    placed = {name: (LEFT + scale * known[name]).round(1) for name in ("low", "median", "high")}
    marks = known.assign(y=TOP + ROW * (np.arange(len(known)) + 0.5), **placed)
    said = [
        f"{subject} {significant(median)} ({span(significant(low), significant(high))})"
        for subject, median, low, high in known[["subject", "median", "low", "high"]].to_numpy()
    ]
    bottom = TOP + ROW * len(known)
    return {
        "symbol": symbol,
        "unit": unit,
        "width": WIDTH,
        "height": bottom + AXIS,
        "bottom": bottom,
        "left": LEFT,
        "right": WIDTH - RIGHT,
        "marks": records(marks),
        "ticks": [(round(LEFT + scale * value, 1), f"{value:g}") for value in ticks],
        "description": f"{symbol} in {unit}: {'; '.join(said)}",
    }


def svg_symbols(text: str) -> Markup:
    """Return plain text as content of an SVG text, with k_0, k_ATP, k_SR and D_T set as symbols."""
    lowered = r'<tspan font-size="10" dy="3">\2</tspan><tspan dy="-3">&#8203;</tspan>'
    symbol = rf'<tspan font-style="italic">\1</tspan>{lowered}'
    return Markup(SYMBOL.sub(symbol, str(escape(text))))
