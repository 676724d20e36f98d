"""A population: whom it holds, beside the subjects of a cohort."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from swesbi.context import CONTEXT, Context, sphere_radius_m
from swesbi.population.contexts import DrawnContext
from swesbi.population.settings import DECLARED_NAMES, DeclaredRange
from swesbi.report.figures.style import (
    EXCLUDED_BACKGROUND,
    OBSERVED,
    SERIES,
    WIDE_IN,
    drawing,
    few_ticks,
    plain,
    shared_legend,
)

LABELS: Final = {variable.name: variable.label for variable in CONTEXT if variable.name != "sex_male"}
PAIRS: Final = (
    ("age_years", "hr_bpm"),
    ("age_years", "lvedv_ml"),
    ("age_years", "ivsd_cm"),
    ("bsa_m2", "lvedv_ml"),
    ("hr_bpm", "lvedv_ml"),
    ("lvedv_ml", "ivsd_cm"),
)
SEXES: Final = {"F": ("female", 0.45), "M": ("male", 0.0)}
"""Name of a sex, and how pale its colour is."""
MARK: Final[Any] = {"color": OBSERVED, "ms": 3.2, "mec": "white", "mew": 0.4}
BINS: Final = {name: 8 if name == "age_years" else 24 for name in LABELS}
POINTS: Final = 2000
"""How many of the contexts the pairs show; the distributions take all."""
PANEL_COLUMNS: Final = 3
MARGIN_FRACTION: Final = 0.06
"""How far an axis reaches beyond everything shown, so that the limits of the declared range are seen."""


def population_figure(
    drawn: Sequence[DrawnContext], shown: Sequence[Context], declared: DeclaredRange, cohort_title: str
) -> Figure:
    """Draw the distributions (above) and pairs (below) of a population, with a cohort's subjects marked.

    Many thousand ``drawn`` contexts make smooth distributions. What lies outside the declared range is grey.
    """
    people = pd.DataFrame([vars(person.context) | {"group": person.group} for person in drawn])
    cohort = pd.DataFrame([vars(context) for context in shown])
    rows = (len(LABELS) + len(PAIRS)) // PANEL_COLUMNS
    with drawing(WIDE_IN, 7.0) as figure:
        panels = figure.subplots(rows, PANEL_COLUMNS).ravel()
        for axes, name in zip(panels, LABELS, strict=False):
            _draw_distribution(axes, name, people, cohort, declared)
        for axes, pair in zip(panels[len(LABELS) :], PAIRS, strict=True):
            _draw_pair(axes, pair, people, cohort, declared)
        panels[0].plot([], [], "v", label=plain(cohort_title), **MARK)
        panels[0].fill_between([], [], color=EXCLUDED_BACKGROUND, label="refused")
        shared_legend(figure, [panels[0]], entries_a_row=4)
    return figure


def _colours(people: pd.DataFrame) -> dict[tuple[str, str], tuple[float, ...]]:
    """Return a colour for every group and sex: the hue is the group, women are paler."""
    groups = sorted(set(people["group"]))
    return {
        (group, sex): tuple((1.0 - pale) * channel + pale for channel in to_rgb(SERIES[i % len(SERIES)]))
        for i, group in enumerate(groups)
        for sex, (_, pale) in SEXES.items()
    }


def _draw_distribution(
    axes: Axes, name: str, people: pd.DataFrame, cohort: pd.DataFrame, declared: DeclaredRange
) -> None:
    """Draw the density of each group and sex, which together have an area of one."""
    for (group, sex), colour in _colours(people).items():
        members = people.loc[(people["group"] == group) & (people["sex"] == sex), name]
        density, edges = np.histogram(members, bins=BINS[name], density=True)
        # bins within the group's own values: the ages of two groups meet at an edge
        label = f"{plain(group)}, {SEXES[sex][0]}"
        axes.stairs(density * len(members) / len(people), edges, color=colour, lw=0.9, label=label)
    marks = np.full(len(cohort), 0.04)
    axes.plot(cohort[name], marks, "v", transform=axes.get_xaxis_transform(), **MARK)
    axes.set_ylim(bottom=0.0)
    axes.set(xlabel=LABELS[name], ylabel="density (per unit)", xlim=_limits(name, people, cohort, declared))
    axes.yaxis.set_major_locator(few_ticks())
    _shade(axes, declared, name, None)


def _draw_pair(
    axes: Axes, pair: tuple[str, str], people: pd.DataFrame, cohort: pd.DataFrame, declared: DeclaredRange
) -> None:
    """Draw contexts in the order of drawing, not by group: no group hides another."""
    points, colours = people[:POINTS], _colours(people)
    colour = [colours[each] for each in zip(points["group"], points["sex"], strict=True)]
    look: dict[str, Any] = {"s": 1.2, "linewidths": 0, "alpha": 0.7, "rasterized": True}
    axes.scatter(points[pair[0]], points[pair[1]], c=colour, **look)
    axes.plot(cohort[pair[0]], cohort[pair[1]], "v", **MARK)
    x, y = (_limits(name, points, cohort, declared) for name in pair)
    axes.set(xlabel=LABELS[pair[0]], ylabel=LABELS[pair[1]], xlim=x, ylim=y)
    _shade(axes, declared, *pair)


def _limits(
    name: str, people: pd.DataFrame, cohort: pd.DataFrame, declared: DeclaredRange
) -> tuple[float, float]:
    ends = declared.limits(name) if name in DECLARED_NAMES else ()
    everything = np.concatenate([people[name], cohort[name], ends])
    margin = MARGIN_FRACTION * float(np.ptp(everything))
    return float(everything.min()) - margin, float(everything.max()) + margin


def _shade(axes: Axes, declared: DeclaredRange, horizontal: str, vertical: str | None) -> None:
    """Grey what lies outside the declared range, within the axes' limits."""
    axes.autoscale(False)
    grey: dict[str, Any] = {"color": EXCLUDED_BACKGROUND, "zorder": 0, "lw": 0}
    for name, span, (start, end) in (
        (horizontal, axes.axvspan, axes.get_xlim()),
        (vertical, axes.axhspan, axes.get_ylim()),
    ):
        if name in DECLARED_NAMES:
            low, high = declared.limits(name)
            span(start, low, **grey)
            span(high, end, **grey)
    if (horizontal, vertical) == ("lvedv_ml", "ivsd_cm"):  # walls too thin or too thick for their cavity
        volume = np.linspace(*declared.lvedv_ml, 100)
        radius_cm = np.array([100.0 * sphere_radius_m(value) for value in volume])
        bottom, top = axes.get_ylim()
        edges = [np.clip(limit * radius_cm, bottom, top) for limit in declared.relative_thickness]
        for edge, beyond in zip(edges, (bottom, top), strict=True):
            axes.fill_between(volume, edge, beyond, **grey)
