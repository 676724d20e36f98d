"""Power of a planned study against the number of persons, a line a number of repeats."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.persons.planning.power import NINETY, PowerCurve
from swesbi.persons.planning.words import Plan
from swesbi.report.figures.style import (
    CMAES,
    DOUBTFUL,
    NETWORK,
    POSTERIOR,
    PRIOR,
    TEXT_WIDTH_IN,
    TRUTH,
    in_percent,
    new_figure,
    style,
)

HEIGHT_IN: Final = 3.2
COLORS: Final = (POSTERIOR, CMAES, TRUTH, NETWORK, DOUBTFUL)


def draw_plan(planned: Plan) -> Figure:
    """Draw power with its Monte Carlo band, what is found without an effect, and the persons needed."""
    with style():
        figure = new_figure(TEXT_WIDTH_IN, HEIGHT_IN)
        axes = figure.subplots()
        for number, curve in enumerate(planned.curves):
            _draw_curve(axes, curve, f"{curve.repeats} repeats", COLORS[number % len(COLORS)])
        axes.axhline(planned.power, color=PRIOR, lw=0.7, ls="--")
        axes.axhline(1.0 - planned.settings.probability, color=PRIOR, lw=0.5, ls=":")
        axes.set(
            xlabel=planned.unit,
            ylabel="share of studies that find it",
            ylim=(0.0, 1.02),
            title=f"{planned.effect.words}, {planned.design}, errors of a repeat {planned.noise:.1%}",
        )
        in_percent(axes.yaxis)
        axes.legend()
    return figure


def _draw_curve(axes: Axes, curve: PowerCurve, name: str, color: str) -> None:
    band = NINETY * curve.power_se
    low, high = np.clip(curve.power - band, 0.0, 1.0), np.clip(curve.power + band, 0.0, 1.0)
    number = curve.needed[0]
    label = f"{name}: {number} needed" if number is not None else f"{name}: not reached"
    axes.fill_between(curve.sizes, low, high, color=color, alpha=0.2, lw=0)
    axes.plot(curve.sizes, curve.power, "o-", color=color, ms=2.5, label=label)
    axes.plot(curve.sizes, curve.false_positive, ":", color=color, lw=0.9, label=f"{name}, no effect")
    if number is not None:
        axes.axvline(number, color=color, lw=0.6)
