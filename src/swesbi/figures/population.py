"""The population of contexts: distributions by group and sex, and how the quantities go together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from swesbi.context import CONTEXT, Context
from swesbi.figures.style import EXCLUDED_BACKGROUND, OBSERVED, TEXT_WIDTH_IN, new_figure, style
from swesbi.population.contexts import Drawn
from swesbi.population.settings import DECLARED_NAMES, DeclaredRange

FloatArray = NDArray[np.float64]
Colour = tuple[float, float, float]

LABELS: Final = {variable.name: variable.label for variable in CONTEXT if variable.name != "sex_male"}
PAIRS: Final = (
    ("age_years", "hr_bpm"),
    ("age_years", "lvedv_ml"),
    ("age_years", "ivsd_cm"),
    ("bsa_m2", "lvedv_ml"),
    ("hr_bpm", "lvedv_ml"),
    ("lvedv_ml", "ivsd_cm"),
)
SEXES: Final[dict[Literal["F", "M"], tuple[str, str]]] = {
    "F": ("female", "#B0307A"),
    "M": ("male", "#0072B2"),
}
MARK: Final[Any] = {"color": OBSERVED, "markersize": 3.2, "markeredgecolor": "white", "markeredgewidth": 0.4}
PALEST: Final = 0.6
BINS: Final = {name: 8 if name == "age_years" else 24 for name in LABELS}
POINTS: Final = 2000
"""How many of the contexts the pairs show; the distributions take all."""
COLUMNS: Final = 3
HEIGHT_IN: Final = 7.0
MARGIN_FRACTION: Final = 0.06
"""How far an axis reaches beyond everything shown, so that the limits of the declared range are seen."""


def population_figure(
    drawn: Sequence[Drawn], shown: Sequence[Context], declared: DeclaredRange, cohort_title: str
) -> Figure:
    """Draw the distributions (above) and pairs (below) of a population, with a cohort's subjects marked.

    Args:
        drawn: Contexts of the population; many thousand make smooth distributions.
        shown: The cohort's subjects.
        declared: The declared range; what lies outside is grey.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    rows = (len(LABELS) + len(PAIRS)) // COLUMNS
    with style():
        figure = new_figure(TEXT_WIDTH_IN * 1.35, HEIGHT_IN)
        panels = figure.subplots(rows, COLUMNS).ravel()
        for axes, name in zip(panels, LABELS, strict=False):
            _distribution(axes, name, drawn, shown, declared)
        for axes, (horizontal, vertical) in zip(panels[len(LABELS) :], PAIRS, strict=True):
            _pair(axes, horizontal, vertical, drawn, shown, declared)
        figure.legend(handles=_legend(drawn, cohort_title), loc="outside lower center", ncols=3)
    return figure


def _distribution(
    axes: Axes, name: str, drawn: Sequence[Drawn], shown: Sequence[Context], declared: DeclaredRange
) -> None:
    everything = _values([one.context for one in drawn], name)
    for (group, sex), colour in _colours(drawn).items():
        own = _values([one.context for one in _members(drawn, group, sex)], name)
        density, edges = np.histogram(own, bins=BINS[name], density=True)
        # Bins within the group's own values: the ages of two groups meet at an edge.
        axes.stairs(density * own.size / len(drawn), edges, color=colour, linewidth=0.9)
    axes.set_ylim(bottom=0.0)
    marks = _values(shown, name)
    axes.plot(marks, np.full(marks.size, 0.04), "v", transform=axes.get_xaxis_transform(), **MARK)
    axes.set_xlim(*_limits(everything, marks, name, declared))
    axes.set_xlabel(LABELS[name])
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    _shade(axes, declared, name, None)


def _pair(
    axes: Axes,
    horizontal: str,
    vertical: str,
    drawn: Sequence[Drawn],
    shown: Sequence[Context],
    declared: DeclaredRange,
) -> None:
    colours = _colours(drawn)
    # In the order of drawing, not by group: no group hides another.
    points = [one.context for one in drawn[:POINTS]]
    own = [colours[one.group, one.context.sex] for one in drawn[:POINTS]]
    x, y = _values(points, horizontal), _values(points, vertical)
    axes.scatter(x, y, s=1.2, c=own, linewidths=0, alpha=0.7, rasterized=True)
    marks_x, marks_y = _values(shown, horizontal), _values(shown, vertical)
    axes.plot(marks_x, marks_y, "v", **MARK)
    axes.set_xlim(*_limits(x, marks_x, horizontal, declared))
    axes.set_ylim(*_limits(y, marks_y, vertical, declared))
    axes.xaxis.set_major_locator(MaxNLocator(6))
    axes.set_xlabel(LABELS[horizontal])
    axes.set_ylabel(LABELS[vertical])
    _shade(axes, declared, horizontal, vertical)


def _shade(axes: Axes, declared: DeclaredRange, horizontal: str, vertical: str | None) -> None:
    """Grey what lies outside the declared range, within the axes' limits."""
    axes.autoscale(False)
    for name, span, limits in (
        (horizontal, axes.axvspan, axes.get_xlim()),
        (vertical, axes.axhspan, axes.get_ylim()),
    ):
        if name in DECLARED_NAMES:
            low, high = declared.limits(name)
            span(limits[0], low, color=EXCLUDED_BACKGROUND, zorder=0, linewidth=0)
            span(high, limits[1], color=EXCLUDED_BACKGROUND, zorder=0, linewidth=0)


def _limits(values: FloatArray, marks: FloatArray, name: str, declared: DeclaredRange) -> tuple[float, float]:
    ends = declared.limits(name) if name in DECLARED_NAMES else ()
    everything = np.concatenate([values, marks, ends])
    margin = MARGIN_FRACTION * float(np.ptp(everything))
    return float(everything.min()) - margin, float(everything.max()) + margin


def _colours(drawn: Sequence[Drawn]) -> dict[tuple[str, Literal["F", "M"]], Colour]:
    """Return a colour for every group and sex: the hue is the sex, later groups are paler."""
    groups = sorted({one.group for one in drawn})
    paleness = np.linspace(0.0, PALEST, len(groups))
    return {
        (group, sex): _pale(hue, pale)
        for group, pale in zip(groups, paleness.tolist(), strict=True)
        for sex, (_, hue) in SEXES.items()
    }


def _pale(colour: str, paleness: float) -> Colour:
    red, green, blue = ((1.0 - paleness) * part + paleness for part in to_rgb(colour))
    return red, green, blue


def _members(drawn: Sequence[Drawn], group: str, sex: Literal["F", "M"]) -> list[Drawn]:
    return [one for one in drawn if one.group == group and one.context.sex == sex]


def _values(contexts: Sequence[Context], name: str) -> FloatArray:
    return np.array([getattr(context, name) for context in contexts], dtype=np.float64)


def _legend(drawn: Sequence[Drawn], cohort_title: str) -> list[Line2D | Patch]:
    people: list[Line2D | Patch] = [
        Line2D([], [], color=colour, label=f"{group}, {SEXES[sex][0]}")
        for (group, sex), colour in _colours(drawn).items()
    ]
    cohort = Line2D([], [], linestyle="none", marker="v", **MARK, label=cohort_title)
    outside = Patch(color=EXCLUDED_BACKGROUND, label="outside the declared range: refused")
    return [*people, cohort, outside]
