"""The choice of the discrepancy: evidence, misfit and coverage over the grid of (delta, tau)."""

from __future__ import annotations

from collections.abc import Callable
from string import ascii_lowercase
from typing import Any, Final

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import ScalarFormatter
from scipy.stats import binom

from swesbi.parameters import THETA_NAMES, THETA_SYMBOLS
from swesbi.report.figures.style import PRIOR, TEXT_WIDTH_IN, drawing, in_percent
from swesbi.report.numbers import as_percent

HEIGHT_IN: Final = 4.2
MARKERS: Final = "osD^vPX*"
CHANCE: Final = 0.9  # mass of the band in which coverage lies by chance
EXPLANATION: Final = r"$\delta$: relative error of the speed; $\tau$: error in phase, of the cycle"


def draw_discrepancy(table: pd.DataFrame, interval: float) -> Figure:
    """Draw evidence, chi-squared and the coverage of each parameter against delta, a line for each tau."""
    with drawing(TEXT_WIDTH_IN, HEIGHT_IN) as figure:
        shown = len(THETA_NAMES)
        grid = figure.add_gridspec(2, 2 * shown)
        evidence, misfit = figure.add_subplot(grid[0, :shown]), figure.add_subplot(grid[0, shown:])
        covered = [figure.add_subplot(grid[1, 2 * column : 2 * column + 2]) for column in range(shown)]
        _evidence(evidence, table)
        _misfit(misfit, table)
        panels = ascii_lowercase[2 : 2 + shown]
        for panel, axes, name, label in zip(panels, covered, THETA_NAMES, THETA_SYMBOLS, strict=True):
            _coverage(axes, table, f"coverage_{name}", interval)
            axes.set_title(f"({panel}) {label}")
        for axes in (evidence, misfit, *covered):
            axes.set_xlabel(r"$\delta$")
        lines, labels = evidence.get_legend_handles_labels()
        place: dict[str, Any] = {"loc": "outside lower center", "ncols": len(labels)}
        figure.legend(lines, labels, title=EXPLANATION, title_fontsize=6.5, **place)
        covered[0].set_ylabel(f"truth in the {as_percent(interval)} interval")
        subjects = int(table["subjects"].iloc[0])
        figure.suptitle(
            f"Choice of the discrepancy: {subjects} generated subjects with known model error", fontsize=7.5
        )
    return figure


def _lines(axes: Axes, table: pd.DataFrame, draw: Callable[[pd.DataFrame, str, str, str], object]) -> None:
    values = sorted(set(table["timing_cycle"]))
    colors = mpl.colormaps["viridis"](np.linspace(0.0, 0.85, len(values)))
    for index, tau in enumerate(values):
        color = mpl.colors.to_hex(colors[index])
        marker, label = MARKERS[index % len(MARKERS)], rf"$\tau$ = {as_percent(tau)}"
        draw(table[table["timing_cycle"] == tau], color, marker, label)
    in_percent(axes.xaxis)


def _evidence(axes: Axes, table: pd.DataFrame) -> None:
    def draw(rows: pd.DataFrame, color: str, marker: str, label: str) -> None:
        axes.errorbar(
            rows["speed_fraction"], -rows["below_best"], rows["below_best_se"].fillna(0.0), color=color,
            marker=marker, ms=2.8, lw=0.9, elinewidth=0.6, label=label,
        )  # fmt: skip

    _lines(axes, table, draw)
    best = table.iloc[int(table["log_evidence"].argmax())]
    axes.plot(best["speed_fraction"], 0.0, marker="o", ms=8, mfc="none", mec="black", ls="")
    axes.set_yscale("symlog", linthresh=10.0)
    axes.set_ylim(top=30.0)
    axes.set_ylabel("log evidence less the best")
    axes.set_title("(a) evidence; circle: best")


def _misfit(axes: Axes, table: pd.DataFrame) -> None:
    def draw(rows: pd.DataFrame, color: str, marker: str, label: str) -> None:
        axes.plot(rows["speed_fraction"], rows["mean_chi2"], color=color, marker=marker, ms=2.8, lw=0.9)

    _lines(axes, table, draw)
    phases = float(table["mean_phases"].iloc[0])
    axes.axhline(phases, color=PRIOR, ls="--", lw=0.8, zorder=0, label="measured phases")
    axes.set_yscale("log", base=2)
    axes.yaxis.set_major_formatter(ScalarFormatter())
    axes.set_ylabel(r"mean $\chi^2$ at the mode")
    axes.set_title("(b) misfit")
    axes.legend(loc="upper right")


def _coverage(axes: Axes, table: pd.DataFrame, column: str, interval: float) -> None:
    def draw(rows: pd.DataFrame, color: str, marker: str, label: str) -> None:
        axes.plot(rows["speed_fraction"], rows[column], color=color, marker=marker, ms=2.8, lw=0.9)

    _lines(axes, table, draw)
    subjects = int(table["subjects"].iloc[0])
    low, high = binom.interval(CHANCE, subjects, interval)
    axes.axhspan(low / subjects, high / subjects, color=PRIOR, alpha=0.2, lw=0)
    axes.axhline(interval, color=PRIOR, ls="--", lw=0.8, zorder=0)
    axes.set_ylim(-0.03, 1.03)
    in_percent(axes.yaxis)
