"""Calibration by stratum: coverage of credible intervals on fresh contexts, and efficiency of the weights."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from swesbi.artefacts import ArtefactError
from swesbi.calibration.ranked import NETWORK, SAMPLERS, WEIGHTED
from swesbi.figures.layout import shared_legend
from swesbi.figures.style import CMAES, POSTERIOR, PRIOR, new_figure, style
from swesbi.figures.text import percent
from swesbi.parameters import THETA_NAMES, THETA_SYMBOLS

COLUMNS: Final = (
    "sampler", "stratum", "parameter", "nominal", "coverage", "ci_low", "ci_high", "n", "median_efficiency",
)  # fmt: skip
NAMES: Final = {"all": "all", "sex F": "female", "sex M": "male"}
QUANTITIES: Final = {
    "age_years": ("age", "years"),
    "hr_bpm": ("heart rate", "/min"),
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


def read_strata(path: Path) -> pd.DataFrame:
    """Read ``strata.csv``.

    Raises:
        ArtefactError: A column or every row is missing.
    """
    table = pd.read_csv(path)
    if missing := [name for name in COLUMNS if name not in table]:
        raise ArtefactError(f"{path}: lacks the columns {', '.join(missing)}; delete it and rerun")
    if table.empty:
        raise ArtefactError(f"{path}: holds no stratum; delete it and rerun")
    return table


def stratum_label(name: str) -> str:
    """Return a stratum in words: "age_years 18 to 40" as "age 18 to 40 years"."""
    quantity, _, limits = name.partition(" ")
    if name in NAMES or quantity not in QUANTITIES:
        return NAMES.get(name, name)
    word, unit = QUANTITIES[quantity]
    return f"{word} {limits} {unit}".rstrip() if unit else f"{word} {_as_percent(limits)}"


def draw(table: pd.DataFrame, interval: float, experiment: str) -> Figure:
    """Draw a panel a parameter and one for the efficiency, a row a stratum.

    Args:
        table: Rows of ``strata.csv``.
        interval: Nominal level that is shown.
        experiment: Name of the experiment.

    Raises:
        ValueError: The table has no rows at that level.
    """
    shown = table[np.isclose(table["nominal"], interval)]
    if shown.empty:
        raise ValueError(f"no coverage of {percent(interval)} intervals is in the table of strata")
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
            f"Coverage of {percent(interval)} intervals by stratum: fresh contexts of the experiment "
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
    axes.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=0, symbol=" %"))
    axes.xaxis.set_major_locator(MaxNLocator(4))
    axes.set_xlabel("coverage")


def _efficiency(axes: Axes, table: pd.DataFrame, names: Sequence[str]) -> None:
    """Draw the median efficiency of the weights, which belongs to the exact posterior."""
    rows = table[table["sampler"] == WEIGHTED].drop_duplicates("stratum")
    axes.barh(
        [names.index(name) for name in rows["stratum"]], rows["median_efficiency"], 0.55, color=POSTERIOR
    )
    for name, value in zip(rows["stratum"], rows["median_efficiency"], strict=True):
        axes.text(value + 0.02, names.index(name), percent(round(value, 2)), va="center", fontsize=5.6)
    axes.set_xlim(0.0, 1.12)
    axes.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=0, symbol=" %"))
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
