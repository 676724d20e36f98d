"""Choices of the study: the size of the discrepancy, and what variants of the configuration move."""

from __future__ import annotations

from collections.abc import Callable
from string import ascii_lowercase
from typing import Any, Final

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, ScalarFormatter
from numpy.typing import NDArray
from scipy.stats import binom

from swesbi.checks.settings import BASE
from swesbi.parameters import THETA_NAMES, THETA_SYMBOLS
from swesbi.show.figures.style import PRIOR, TEXT_WIDTH_IN, in_percent, new_figure, style
from swesbi.show.numbers import as_percent

HEIGHT_IN: Final = 4.2
CHANCE: Final = 0.9  # mass of the band in which coverage lies by chance
EXPLANATION: Final = r"$\delta$: relative error of the speed; $\tau$: error in phase, of the cycle"
MARKERS: Final = "osD^vPX*"
ROW_HEIGHT_IN: Final = 0.17
FRAME_HEIGHT_IN: Final = 1.3
COLOURS: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C8C8C", "#000000")


def draw_discrepancy(table: pd.DataFrame, interval: float) -> Figure:
    """Draw evidence, chi-squared and the coverage of each parameter against delta, a line for each tau.

    Args:
        table: As of :func:`swesbi.checks.discrepancy.evidence.discrepancy_table`.
        interval: Mass of the intervals whose coverage is shown.
    """
    with style():
        figure = new_figure(TEXT_WIDTH_IN, HEIGHT_IN)
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


def draw_sensitivity(table: pd.DataFrame, cohort_title: str) -> Figure:
    """Draw shifts (above) and width ratios (below) of every variant, a column a parameter.

    Args:
        table: The rows of ``sensitivity.csv``.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    shown = table[table["variant"] != BASE]
    names = list(dict.fromkeys(shown["label"]))
    with style():
        figure = new_figure(TEXT_WIDTH_IN * 1.35, 2 * (ROW_HEIGHT_IN * len(names)) + FRAME_HEIGHT_IN)
        axes = figure.subplots(2, len(THETA_NAMES), sharey=True)
        for column, (parameter, symbol) in enumerate(zip(THETA_NAMES, THETA_SYMBOLS, strict=True)):
            rows = shown[shown["parameter"] == parameter]
            subject_points(axes[0, column], rows, names, "shift_in_widths")
            axes[0, column].axvspan(-0.5, 0.5, color="#EDEDED", zorder=0)
            axes[0, column].set_title(symbol)
            subject_points(axes[1, column], rows, names, "width_ratio")
            _ratios(axes[1, column], rows["width_ratio"].to_numpy())
        middle = (len(THETA_NAMES) - 1) // 2
        axes[0, middle].set_xlabel(
            "shift of the median, in widths of the base's interval (grey: within a half)"
        )
        axes[1, middle].set_xlabel("width of the interval over the base's")
        handles, labels = axes[0, 0].get_legend_handles_labels()
        title = f"subject ({cohort_title})"
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), title=title)
    return figure


def _ratios(axes: Axes, ratios: NDArray[np.float64]) -> None:
    """Show ratios on a logarithmic axis that reaches a factor of two both ways at least."""
    reach = max(2.0, 1.1 * float(np.exp(np.abs(np.log(ratios)).max())))
    axes.set_xscale("log", base=2)
    axes.set_xlim(1.0 / reach, reach)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.axvline(1.0, color=PRIOR, linewidth=0.6)


def subject_points(axes: Axes, rows: pd.DataFrame, names: list[str], column: str) -> None:
    """Draw a column of rows, each at the height of its label among ``names``, a marker a subject."""
    subjects = list(dict.fromkeys(rows["subject"]))
    offsets = np.linspace(-0.28, 0.28, len(subjects)) if len(subjects) > 1 else np.zeros(1)
    for number, (subject, offset) in enumerate(zip(subjects, offsets, strict=True)):
        points = rows[rows["subject"] == subject]
        height = [names.index(label) + offset for label in points["label"]]
        look: dict[str, Any] = {
            "color": COLOURS[number % len(COLOURS)],
            "marker": MARKERS[number % len(MARKERS)],
        }
        axes.plot(points[column], height, linestyle="none", markersize=2.4, label=subject, **look)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.grid(axis="y", linewidth=0.3, color="#DDDDDD")
