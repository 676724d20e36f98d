"""A population: whom it holds, and the calibration of its network by stratum."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import Annotated, Any, Final, Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from swesbi.artefacts.csv import Table
from swesbi.checks.calibration.ranks import NETWORK, SAMPLERS, WEIGHTED
from swesbi.context import CONTEXT, Context, sphere_radius_m
from swesbi.parameters import THETA_NAMES, THETA_SYMBOLS
from swesbi.population.contexts import DrawnContext
from swesbi.population.settings import DECLARED_NAMES, DeclaredRange
from swesbi.report.figures.style import (
    CMAES,
    EXCLUDED_BACKGROUND,
    OBSERVED,
    POSTERIOR,
    PRIOR,
    TEXT_WIDTH_IN,
    Drawing,
    in_percent,
    new_figure,
    plain,
    shared_legend,
    style,
)
from swesbi.report.numbers import as_percent

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
SEXES: Final[dict[Literal["F", "M"], tuple[str, float]]] = {"F": ("female", 0.45), "M": ("male", 0.0)}
"""Name of a sex, and how pale its colour is."""
HUES: Final = ("#0072B2", "#009E73", "#D55E00", "#8E2A8E")
"""Of the groups by name, again from the first where there are more."""
MARK: Final[Any] = {"color": OBSERVED, "markersize": 3.2, "markeredgecolor": "white", "markeredgewidth": 0.4}
BINS: Final = {name: 8 if name == "age_years" else 24 for name in LABELS}
POINTS: Final = 2000
"""How many of the contexts the pairs show; the distributions take all."""
PANEL_COLUMNS: Final = 3
HEIGHT_IN: Final = 7.0
MARGIN_FRACTION: Final = 0.06
"""How far an axis reaches beyond everything shown, so that the limits of the declared range are seen."""
STRATA: Final = Table(
    columns=(
        "sampler", "stratum", "parameter", "nominal", "coverage", "ci_low", "ci_high", "n",
        "median_efficiency",
    ),
    row="stratum",
)  # fmt: skip
StrataTable = Annotated[pd.DataFrame, STRATA]
"""``strata.csv``."""
NAMES: Final = {"all": "all", "sex F": "female", "sex M": "male"}
QUANTITIES: Final = {
    "age_years": ("age", "years"),
    "hr_bpm": ("heart rate", "/min"),
    "lvedv_ml": ("LVEDV", "mL"),
    "ivsd_cm": ("septum", "cm"),
    "relative_se": ("noise of a speed", ""),
}
BANDS: Final = (
    (0.05, "#EFEFEF", "5 points: asked of each stratum"),
    (0.02, "#D2D2D2", "2 points: asked of all"),
)
LOOKS: Final = {NETWORK: (CMAES, "network alone"), WEIGHTED: (POSTERIOR, "exact posterior")}
WIDTH_IN: Final = 7.2
FRAME_HEIGHT_IN: Final = 1.1
ROW_HEIGHT_IN: Final = 0.24
OFFSET: Final = 0.17


def population_figure(
    drawn: Sequence[DrawnContext], shown: Sequence[Context], declared: DeclaredRange, cohort_title: str
) -> Figure:
    """Draw the distributions (above) and pairs (below) of a population, with a cohort's subjects marked.

    Args:
        drawn: Contexts of the population; many thousand make smooth distributions.
        shown: The cohort's subjects.
        declared: The declared range; what lies outside is grey.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    rows = (len(LABELS) + len(PAIRS)) // PANEL_COLUMNS
    with style():
        figure = new_figure(TEXT_WIDTH_IN * 1.35, HEIGHT_IN)
        panels = figure.subplots(rows, PANEL_COLUMNS).ravel()
        for axes, name in zip(panels, LABELS, strict=False):
            _distribution(axes, name, drawn, shown, declared)
        for axes, (horizontal, vertical) in zip(panels[len(LABELS) :], PAIRS, strict=True):
            _pair(axes, horizontal, vertical, drawn, shown, declared)
        figure.legend(
            handles=_legend(drawn, cohort_title), loc="outside lower center", ncols=5, columnspacing=1.2
        )
    return figure


def _distribution(
    axes: Axes, name: str, drawn: Sequence[DrawnContext], shown: Sequence[Context], declared: DeclaredRange
) -> None:
    everything = _values([person.context for person in drawn], name)
    for (group, sex), colour in _colours(drawn).items():
        members = _values([person.context for person in _members(drawn, group, sex)], name)
        density, edges = np.histogram(members, bins=BINS[name], density=True)
        # Bins within the group's own values: the ages of two groups meet at an edge.
        axes.stairs(density * members.size / len(drawn), edges, color=colour, linewidth=0.9)
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
    drawn: Sequence[DrawnContext],
    shown: Sequence[Context],
    declared: DeclaredRange,
) -> None:
    colours = _colours(drawn)
    # In the order of drawing, not by group: no group hides another.
    points = [person.context for person in drawn[:POINTS]]
    point_colours = [colours[person.group, person.context.sex] for person in drawn[:POINTS]]
    x, y = _values(points, horizontal), _values(points, vertical)
    axes.scatter(x, y, s=1.2, c=point_colours, linewidths=0, alpha=0.7, rasterized=True)
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
    if (horizontal, vertical) == ("lvedv_ml", "ivsd_cm"):
        _shade_thickness(axes, declared)


def _shade_thickness(axes: Axes, declared: DeclaredRange) -> None:
    """Grey walls too thin or too thick for their cavity, over LVEDV (mL) and IVSd (cm)."""
    volume = np.linspace(*declared.lvedv_ml, 100)
    radius_cm = np.array([100.0 * sphere_radius_m(value) for value in volume])
    low, high = declared.relative_thickness
    bottom, top = axes.get_ylim()
    thinnest, thickest = (np.clip(limit * radius_cm, bottom, top) for limit in (low, high))
    for edge, beyond in ((thinnest, bottom), (thickest, top)):
        axes.fill_between(volume, edge, beyond, color=EXCLUDED_BACKGROUND, zorder=0, linewidth=0)


def _limits(values: FloatArray, marks: FloatArray, name: str, declared: DeclaredRange) -> tuple[float, float]:
    ends = declared.limits(name) if name in DECLARED_NAMES else ()
    everything = np.concatenate([values, marks, ends])
    margin = MARGIN_FRACTION * float(np.ptp(everything))
    return float(everything.min()) - margin, float(everything.max()) + margin


def _colours(drawn: Sequence[DrawnContext]) -> dict[tuple[str, Literal["F", "M"]], Colour]:
    """Return a colour for every group and sex: the hue is the group, women are paler."""
    groups = sorted({person.group for person in drawn})
    return {
        (group, sex): _pale(hue, pale)
        for group, hue in zip(groups, cycle(HUES), strict=False)
        for sex, (_, pale) in SEXES.items()
    }


def _pale(colour: str, paleness: float) -> Colour:
    red, green, blue = ((1.0 - paleness) * channel + paleness for channel in to_rgb(colour))
    return red, green, blue


def _members(drawn: Sequence[DrawnContext], group: str, sex: Literal["F", "M"]) -> list[DrawnContext]:
    return [person for person in drawn if person.group == group and person.context.sex == sex]


def _values(contexts: Sequence[Context], name: str) -> FloatArray:
    return np.array([getattr(context, name) for context in contexts], dtype=np.float64)


def _legend(drawn: Sequence[DrawnContext], cohort_title: str) -> list[Line2D | Patch]:
    people: list[Line2D | Patch] = [
        Line2D([], [], color=colour, label=f"{group}, {SEXES[sex][0]}")
        for (group, sex), colour in _colours(drawn).items()
    ]
    cohort = Line2D([], [], linestyle="none", marker="v", **MARK, label=plain(cohort_title))
    outside = Patch(color=EXCLUDED_BACKGROUND, label="refused")
    return [*people, cohort, outside]


def stratum_label(name: str) -> str:
    """Return a stratum in words: "age_years 18 to 40" as "age 18 to 40 years"."""
    quantity, _, limits = name.partition(" ")
    if name in NAMES or quantity not in QUANTITIES:
        return NAMES.get(name, name)
    word, unit = QUANTITIES[quantity]
    return f"{word} {limits} {unit}".rstrip() if unit else f"{word} {_as_percent(limits)}"


def draw_strata(strata: StrataTable, *, interval: float, experiment: str) -> Drawing:
    """Draw a panel a parameter and one for the efficiency, a row a stratum.

    Args:
        strata: ``strata.csv``.
        interval: Nominal level that is shown.
        experiment: Name of the experiment.

    Raises:
        ValueError: The table has no rows at that level.
    """
    shown = strata[np.isclose(strata["nominal"], interval)]
    if shown.empty:
        raise ValueError(f"no coverage of {as_percent(interval)} intervals is in the table of strata")
    names = list(dict.fromkeys(shown["stratum"]))
    lowest = min(interval - 0.08, float(shown["ci_low"].min()) - 0.01)
    with style():
        figure = new_figure(WIDTH_IN, FRAME_HEIGHT_IN + ROW_HEIGHT_IN * len(names))
        panels = figure.subplots(1, len(THETA_NAMES) + 1, sharey=True)
        for axes, name, symbol in zip(panels, THETA_NAMES, THETA_SYMBOLS, strict=False):
            _coverage(axes, shown[shown["parameter"] == name], names, interval)
            axes.set_xlim(lowest, 1.01)
            axes.set_title(symbol)
        _efficiency(panels[-1], shown, names)
        _name(panels[0], shown, names)
        figure.suptitle(
            f"Coverage of {as_percent(interval)} intervals by stratum: fresh contexts of the experiment "
            f"'{experiment}'",
            fontsize=7.5,
        )
        shared_legend(figure, [panels[0]], entries_a_row=5)
    return figure


def _coverage(axes: Axes, table: pd.DataFrame, names: Sequence[str], interval: float) -> None:
    for reach, color, label in BANDS:
        axes.axvspan(interval - reach, interval + reach, color=color, lw=0, zorder=0, label=f"± {label}")
    axes.axvline(interval, color=PRIOR, lw=0.8, ls="--", zorder=1, label="nominal")
    for sampler, (color, label) in LOOKS.items():
        rows = table[table["sampler"] == sampler]
        ends = [rows["coverage"] - rows["ci_low"], rows["ci_high"] - rows["coverage"]]
        axes.errorbar(
            rows["coverage"], _places(rows, names, sampler), xerr=np.clip(ends, 0.0, None), fmt="o", ms=2.6,
            mew=0, lw=0.9, color=color, label=label,
        )  # fmt: skip
    in_percent(axes.xaxis)
    axes.xaxis.set_major_locator(MaxNLocator(4))
    axes.set_xlabel("coverage")


def _efficiency(axes: Axes, table: pd.DataFrame, names: Sequence[str]) -> None:
    """Draw the median efficiency of the weights, which belongs to the exact posterior."""
    rows = table[table["sampler"] == WEIGHTED].drop_duplicates("stratum")
    axes.barh(
        [names.index(name) for name in rows["stratum"]], rows["median_efficiency"], 0.55, color=POSTERIOR
    )
    for name, value in zip(rows["stratum"], rows["median_efficiency"], strict=True):
        axes.text(value + 0.02, names.index(name), as_percent(round(value, 2)), va="center", fontsize=5.6)
    axes.set_xlim(0.0, 1.12)
    in_percent(axes.xaxis)
    axes.set_xticks([0.0, 0.5, 1.0])
    axes.set_xlabel("median efficiency")
    axes.set_title("weights")


def _places(rows: pd.DataFrame, names: Sequence[str], sampler: str) -> list[float]:
    offset = OFFSET * (2 * SAMPLERS.index(sampler) - 1)
    return [names.index(name) + offset for name in rows["stratum"]]


def _name(axes: Axes, table: pd.DataFrame, names: Sequence[str]) -> None:
    """Name the strata from top to bottom, with the number of recordings in each."""
    numbers = table.drop_duplicates("stratum").set_index("stratum")["n"]
    labels = [f"{stratum_label(name)} (n = {int(numbers[name])})" for name in names]
    axes.set_yticks(range(len(names)), labels)
    axes.set_ylim(len(names) - 0.5, -0.5)


def _as_percent(limits: str) -> str:
    """Return limits of a fraction in percent: "below 0.0205" as "below 2.05 %"."""
    words = [f"{100.0 * float(word):g}" if word[0].isdigit() else word for word in limits.split()]
    last = max((index for index, word in enumerate(words) if word[0].isdigit()), default=0)
    words[last] += " %"
    return " ".join(words)
