"""The ladder of structures: evidence, model probabilities, and how far each quantity moves."""

from __future__ import annotations

from textwrap import wrap
from typing import Any, Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from studies.ladder.posteriors import SHIPPED
from studies.ladder.quantities import ATTAINED, CHANGE_OF, SHOWN
from studies.ladder.table import ABOUT_PEOPLE, AVERAGE
from studies.subject_points import subject_points
from swesbi.checks.settings import BASE
from swesbi.parameters import THETA_NAMES, THETA_SYMBOLS
from swesbi.report.figures.style import (
    EXCLUDED_BACKGROUND,
    PRIOR,
    TEXT_WIDTH_IN,
    in_percent,
    new_figure,
    plain,
    style,
)

WIDTH_IN: Final = 1.6 * TEXT_WIDTH_IN
ROW_HEIGHT_IN: Final = 0.2
FRAME_HEIGHT_IN: Final = 1.9
LINEAR: Final = 5.0  # log evidence within this is shown on a linear scale
SYMBOLS: Final = dict(zip(THETA_NAMES, THETA_SYMBOLS, strict=True))
TITLES: Final = {
    "k0_kpa": f"{SYMBOLS['k0_kpa']} (conditional)",
    ATTAINED: "attained stiffness",
    SHOWN: "shown stiffness",
    "k_sr_per_s": SYMBOLS["k_sr_per_s"],
    "k_atp_per_s": SYMBOLS["k_atp_per_s"],
    f"{CHANGE_OF}k0_kpa": f"change of {SYMBOLS['k0_kpa']}",
    f"{CHANGE_OF}{SHOWN}": "change of shown",
    f"{CHANGE_OF}k_sr_per_s": f"change of {SYMBOLS['k_sr_per_s']}",
}
"""Quantities whose moves are drawn beside evidence and probability, half of them in each row."""


def draw_ladder(table: pd.DataFrame, survives_widths: float, cohort_title: str) -> Figure:
    """Draw evidence, probability and moves of the medians of each structure, at the shipped discrepancy.

    Args:
        table: The rows of ``ladder.csv``.
        survives_widths: Half the width of the grey band, in widths of the base's interval.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    shown = _against_base(table[table["answer"] == SHIPPED])
    names = list(dict.fromkeys(shown["label"]))
    with style():
        figure = new_figure(WIDTH_IN, 2 * ROW_HEIGHT_IN * len(names) + FRAME_HEIGHT_IN)
        axes = figure.subplots(2, 1 + len(TITLES) // 2, sharey=True)
        of_each = shown.groupby(["structure", "subject"], sort=False).first().reset_index()
        of_each = of_each[of_each["structure"] != AVERAGE]
        _evidence(axes[0, 0], of_each, names)
        _probability(axes[1, 0], of_each, names)
        for panel, quantity in zip(axes[:, 1:].flat, TITLES, strict=True):
            _moves(panel, shown[shown["quantity"] == quantity], names, quantity, survives_widths)
        handles, labels = axes[0, 1].get_legend_handles_labels()
        place: dict[str, Any] = {"loc": "outside lower center", "ncols": len(labels)}
        figure.legend(handles, labels, title=f"subject ({plain(cohort_title)})", **place)
        figure.suptitle(
            "Log evidence less the base's; shifts in widths of the base's interval (grey: survives).\n"
            "$k_0$ in kPa is conditional on the structure.\n" + "\n".join(wrap(ABOUT_PEOPLE, 110)),
            fontsize=6.5,
        )
    return figure


def _against_base(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows with the log evidence less the base's of the same subject."""
    base = rows[rows["structure"] == BASE].groupby("subject")["log_evidence"].first()
    return rows.assign(against_base=rows["log_evidence"] - rows["subject"].map(base))


def _evidence(axes: Axes, rows: pd.DataFrame, names: list[str]) -> None:
    subject_points(axes, rows, names, "against_base")
    axes.set_xscale("symlog", linthresh=LINEAR)
    reach = max(LINEAR, 1.5 * float(rows["against_base"].abs().max()))
    axes.set_xlim(-reach, reach)
    far = 10.0 ** np.floor(np.log10(reach))
    axes.xaxis.set_major_locator(FixedLocator([-far, 0.0, far]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.axvline(0.0, color=PRIOR, linewidth=0.6)
    axes.set_title("log evidence")


def _probability(axes: Axes, rows: pd.DataFrame, names: list[str]) -> None:
    subject_points(axes, rows, names, "probability")
    axes.set_xlim(-0.02, 1.02)
    in_percent(axes.xaxis)
    axes.set_title("model probability")


def _moves(axes: Axes, rows: pd.DataFrame, names: list[str], quantity: str, survives_widths: float) -> None:
    moved = rows[rows["structure"] != BASE]
    subject_points(axes, moved, names, "shift_in_widths")
    axes.axvspan(-survives_widths, survives_widths, color=EXCLUDED_BACKGROUND, zorder=0)
    reach = max(2.0 * survives_widths, 1.1 * float(np.abs(moved["shift_in_widths"]).max()))
    axes.set_xlim(-reach, reach)
    axes.set_title(TITLES[quantity])
