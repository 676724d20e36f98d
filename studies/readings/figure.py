"""Readings of the paper's text: every printed number, in the paper's spreads, by reading."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from studies.readings.comparison import INTERVALS, PAPER, deviations, printed_numbers
from studies.readings.settings import ComparisonSettings
from swesbi.report.figures.style import (
    CMAES,
    EXCLUDED_BACKGROUND,
    POSTERIOR,
    PRIOR,
    TEXT_WIDTH_IN,
    new_figure,
    plain,
    style,
)
from swesbi.report.paper.values import PaperNumber
from swesbi.report.results import records

WIDTH_IN: Final = 1.9 * TEXT_WIDTH_IN
ROW_HEIGHT_IN: Final = 0.17
FRAME_HEIGHT_IN: Final = 1.1
WITHIN: Final = 1.0
LINEAR: Final = 2.0  # spreads within which the scale is linear
GROUPS: Final = {
    "support, fit": ("supported", "rmse_prior_kpa", "rmse_kpa", "rmse_reduction_percent", "r2"),
    "coverage of the curve": ("coverage_A", "coverage_B", "coverage_C", "coverage_D"),
    "features, correlations": ("features_inside", "r_k0_k_atp", "r_k0_k_sr", "r_k_atp_k_sr"),
    "recovery": ("recovery_k0_percent", "recovery_k_atp_percent", "recovery_k_sr_percent"),
}
"""Panels with the numbers that each shows, from left to right; markers tell them apart."""
MARKERS: Final = ("o", "s", "^", "D", "v")
NAMES: Final = {
    "supported": "supported",
    "rmse_prior_kpa": "RMSE, prior",
    "rmse_kpa": "RMSE",
    "rmse_reduction_percent": "reduction",
    "r2": "$R^2$",
    **{f"coverage_{case}": case for case in "ABCD"},
    "features_inside": "features inside",
    "r_k0_k_atp": "$r(k_0, k_{ATP})$",
    "r_k0_k_sr": "$r(k_0, k_{SR})$",
    "r_k_atp_k_sr": "$r(k_{ATP}, k_{SR})$",
    "recovery_k0_percent": "$k_0$",
    "recovery_k_atp_percent": "$k_{ATP}$",
    "recovery_k_sr_percent": "$k_{SR}$",
}


def draw_readings(
    table: pd.DataFrame, paper: Sequence[PaperNumber], comparison: ComparisonSettings, cohort_title: str
) -> Figure:
    """Draw by how many of the paper's spreads each number of each reading is off.

    Args:
        table: The rows of ``readings.csv``.
        paper: The numbers of the paper.
        comparison: What a spread is.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    tried = table[table["reading"] != PAPER]
    printed = printed_numbers(paper, comparison)
    off = {
        interval: pd.DataFrame([deviations(row, printed, interval, comparison) for row in records(tried)])
        for interval in INTERVALS
    }
    reach = 1.3 * max(LINEAR, float(np.abs(pd.concat(off.values()).to_numpy()).max()))
    with style():
        figure = new_figure(WIDTH_IN, ROW_HEIGHT_IN * len(tried) + FRAME_HEIGHT_IN)
        axes = figure.subplots(1, len(GROUPS), sharey=True)
        for panel, (title, keys) in zip(axes, GROUPS.items(), strict=True):
            _panel(panel, keys, off, reach)
            panel.set_title(title)
        axes[0].set_yticks(range(len(tried)), list(tried["label"]))
        axes[0].invert_yaxis()
        figure.suptitle(
            f"Readings of the paper's text ({plain(cohort_title)}): each printed number, here less there, "
            "in the paper's spreads\n(grey: within one; coverage filled: by the interval of a new "
            "observation, open: by the band of curves)",
            fontsize=6.5,
        )
    return figure


def _panel(axes: Axes, keys: Sequence[str], off: dict[str, pd.DataFrame], reach: float) -> None:
    axes.axvspan(-WITHIN, WITHIN, color=EXCLUDED_BACKGROUND, zorder=0)
    axes.axvline(0.0, color=PRIOR, linewidth=0.6)
    for index, (key, marker) in enumerate(zip(keys, MARKERS, strict=False)):
        by_interval = key.startswith("coverage")
        y = np.arange(len(off["observed"])) + 0.13 * (index - 0.5 * (len(keys) - 1))
        colour = CMAES if index % 2 else POSTERIOR
        shown: dict[str, Any] = {
            "s": 9,
            "marker": marker,
            "linewidths": 0.6,
            "edgecolors": colour,
            "zorder": 2,
        }
        axes.scatter(off["observed"][key], y, color=colour, label=NAMES[key], **shown)
        if by_interval:
            axes.scatter(off["curve"][key], y, facecolors="none", **shown)
    axes.set_xscale("symlog", linthresh=LINEAR)
    axes.set_xlim(-reach, reach)
    ticks = [tick for tick in (2.0, 10.0, 100.0) if tick < reach]
    axes.xaxis.set_major_locator(FixedLocator([*(-tick for tick in reversed(ticks)), 0.0, *ticks]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_xlabel("spreads")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2, fontsize=5.5, frameon=False)
