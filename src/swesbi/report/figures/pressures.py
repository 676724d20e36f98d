"""What the pressures of a cuff add: intervals without and with them, by quantity and subject."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from swesbi.artefacts import UnfitError
from swesbi.checks.pressures import RESISTANCE, PressuresTable
from swesbi.heart.physiology import TIME_CONSTANT, VOLUME_FACTOR
from swesbi.parameters import NUISANCES, PEAK_ACTIVE, PHI
from swesbi.report.figures.style import (
    EXCLUDED_POSTERIOR,
    POSTERIOR,
    PRIOR,
    TEXT_WIDTH_IN,
    Drawing,
    new_figure,
    plain,
    shared_legend,
    style,
)

WIDTH_IN: Final = 1.6 * TEXT_WIDTH_IN
ROW_HEIGHT_IN: Final = 0.17
FRAME_HEIGHT_IN: Final = 1.0
OFFSET: Final = 0.16
MOST_DRAWN: Final = 40
"""Subjects of the figure, the first ones; the table has all."""
SYMBOLS: Final = {parameter.name: parameter for parameter in (*PHI, *NUISANCES)}
DRAWN: Final = (
    ("k0_kpa", "k_atp_per_s", "k_sr_per_s", "passive_stiffness_kpa"),
    (PEAK_ACTIVE.name, RESISTANCE, TIME_CONSTANT, VOLUME_FACTOR),
)
"""Quantities with a panel each, row by row."""
LOOKS: Final[dict[str, dict[str, Any]]] = {
    "without": {"color": EXCLUDED_POSTERIOR, "marker": "o", "label": "speeds alone"},
    "with": {"color": POSTERIOR, "marker": "s", "label": "speeds and cuff pressures"},
}


def draw_pressures(table: PressuresTable, *, experiment: str, cohort_title: str) -> Drawing:
    """Draw medians and intervals without and with pressures, a panel a quantity and a row a subject.

    Args:
        table: ``pressures.csv``.
        experiment: Whose rows are drawn.
        cohort_title: What the subjects are ("virtual volunteers").

    Raises:
        UnfitError: The table has no row of the experiment.
    """
    table = table[table["experiment"] == experiment]
    if table.empty:
        raise UnfitError("table", f"holds no {experiment}; delete it and rerun")
    subjects = list(dict.fromkeys(table["subject"]))[:MOST_DRAWN]
    with style():
        figure = new_figure(WIDTH_IN, 2 * (ROW_HEIGHT_IN * len(subjects) + FRAME_HEIGHT_IN))
        axes = figure.subplots(2, len(DRAWN[0]), sharey=True)
        for panel, name in zip(axes.flat, (name for row in DRAWN for name in row), strict=True):
            _panel(panel, table[table["quantity"] == name], subjects, name)
        for first in axes[:, 0]:
            first.set_yticks(range(len(subjects)), subjects)
            first.set_ylim(len(subjects) - 0.5, -0.5)
        figure.suptitle(f"Without and with the pressures of a cuff ({plain(cohort_title)})", fontsize=7.5)
        shared_legend(figure, axes.flat, len(LOOKS))
    return figure


def _panel(axes: Axes, rows: pd.DataFrame, subjects: list[str], name: str) -> None:
    shown = rows[rows["subject"].isin(subjects)]
    at = np.array([subjects.index(subject) for subject in shown["subject"]], dtype=np.float64)
    for which, side in zip(LOOKS, (-1.0, 1.0), strict=True):
        low, median, high = (shown[f"{which}_{end}"].to_numpy(float) for end in ("low", "median", "high"))
        axes.errorbar(
            median, at + side * OFFSET, xerr=np.stack([median - low, high - median]), linestyle="none",
            markersize=2.4, elinewidth=0.7, **LOOKS[which],
        )  # fmt: skip
    axes.set_title(
        "peak active stiffness (kPa)" if name == PEAK_ACTIVE.name else SYMBOLS[name].label, fontsize=6.5
    )
    if name == VOLUME_FACTOR:
        axes.axvline(1.0, color=PRIOR, linewidth=0.6)
    ratio = float(shown["width_ratio"].median())
    if np.isfinite(ratio):
        axes.set_xlabel(f"width {ratio:.2f} of that without", fontsize=5.5)
