"""Power of a planned study against the number of persons, a line a number of repeats."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.figure import Figure

from swesbi.checks.scores import Band
from swesbi.persons.planning.power import NINETY, Plan
from swesbi.report.figures.band import draw_band
from swesbi.report.figures.style import (
    CMAES,
    DOUBTFUL,
    NETWORK,
    POSTERIOR,
    PRIOR,
    TEXT_WIDTH_IN,
    TRUTH,
    drawing,
    in_percent,
    shared_legend,
)

COLORS: Final = (POSTERIOR, CMAES, TRUTH, NETWORK, DOUBTFUL)


def draw_plan(planned: Plan) -> Figure:
    """Draw power with its Monte Carlo band, what is found without an effect, and the persons needed."""
    with drawing(TEXT_WIDTH_IN, 3.4) as figure:
        axes = figure.subplots()
        for number, curve in enumerate(planned.curves):
            color, name, needed = COLORS[number % len(COLORS)], f"{curve.repeats} repeats", curve.needed[0]
            ends = (np.clip(curve.power + side * NINETY * curve.power_se, 0.0, 1.0) for side in (-1.0, 1.0))
            reached = f"{needed} needed" if needed is not None else "not reached"
            sizes, label = curve.sizes.astype(float), f"{name}, 90 % band: {reached}"
            draw_band(axes, sizes, Band(curve.power, *ends), color, label)
            axes.plot(sizes, curve.power, "o", color=color, ms=2.5)
            axes.plot(sizes, curve.false_positive, ":", color=color, label=f"{name}, no effect")
            if needed is not None:
                axes.axvline(needed, color=color, lw=0.6)
        axes.axhline(planned.power, color=PRIOR, lw=0.7, ls="--", label="power asked for")
        level = 1.0 - planned.settings.probability
        axes.axhline(level, color=PRIOR, lw=0.5, ls=":", label="false alarms of the rule")
        axes.set(
            xlabel=planned.unit,
            ylabel="share of studies that find it",
            ylim=(0.0, 1.02),
            title=f"{planned.effect.words}, {planned.design}, errors of a repeat {planned.noise:.1%}",
        )
        in_percent(axes.yaxis)
        shared_legend(figure, [axes], 2)
    return figure
