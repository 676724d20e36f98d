"""Calibration of an experiment: ranks, coverage, weights, and what holds at each subject's own data."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import cycle
from string import ascii_lowercase
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from swesbi.checks.calibration.dataset import Calibration
from swesbi.checks.calibration.ranks import (
    NETWORK,
    QUANTITY_NAMES,
    WEIGHTED,
    Diagnostics,
    RankedRecordings,
    central_level,
)
from swesbi.checks.calibration.settings import JudgementSettings
from swesbi.checks.calibration.table import (
    C2ST,
    LOCAL,
    POOLED,
    SBC,
    TARP,
    CalibrationTable,
    band,
    points,
    uniformity,
)
from swesbi.parameters import ISOMETRIC, ISOMETRIC_SYMBOL, PHI_NAMES, PHI_SYMBOLS
from swesbi.report.figures.style import (
    CMAES,
    OBSERVED,
    POSTERIOR,
    PRIOR,
    TEXT_WIDTH_IN,
    Drawing,
    in_percent,
    new_figure,
    shared_legend,
    style,
    titled,
)
from swesbi.report.numbers import share

FloatArray = NDArray[np.float64]
ROW_HEIGHT_IN: Final = 6.9 / 4
GRID_COLUMNS: Final = 3
BAND: Final = "#DCDCDC"
LABELS: Final = {**PHI_SYMBOLS, ISOMETRIC: ISOMETRIC_SYMBOL, "log_likelihood": "log-likelihood"}
PARAMETERS: Final = PHI_NAMES
COLORS: Final = dict(
    zip(PARAMETERS, cycle(("#009E73", "#CC79A7", "#000000", "#E69F00", "#56B4E9")), strict=False)
)
SAMPLER_COLORS: Final = {NETWORK: CMAES, WEIGHTED: POSTERIOR}
SAMPLER_NAMES: Final = {NETWORK: "network", WEIGHTED: "weighted (reported)"}
REPORTED: Final = 0.9


@dataclass(frozen=True)
class CalibrationCase:
    """What the figure shows.

    Attributes:
        ranked: Recordings by how they were made: "model_noise", "sample_by_sample" and "local".
        diagnostics: Of the exact posteriors of the "model_noise" recordings.
        table: Rows of ``calibration.csv``.
        settings: What is asked.
        max_k_hat: Pareto shape above which weights are not used.
    """

    ranked: Mapping[str, RankedRecordings]
    diagnostics: Diagnostics
    table: pd.DataFrame
    settings: JudgementSettings
    max_k_hat: float


def draw_calibration(
    calibration: Calibration,
    table: CalibrationTable,
    *,
    judgement: JudgementSettings,
    max_k_hat: float,
    experiment: str,
    cohort_title: str,
) -> Drawing:
    """Draw the ranks of each quantity, a panel each, then coverage, weights and local calibration.

    Args:
        calibration: Recordings of known parameters.
        table: ``calibration.csv``.
        judgement: What is asked.
        max_k_hat: Pareto shape above which weights are not used.
        experiment: Name of the experiment.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    own, acquired = calibration.model_noise, calibration.sample_by_sample
    ranked = {"model_noise": own.ranked, "sample_by_sample": acquired.ranked, "local": calibration.local}
    case = CalibrationCase(ranked, own.diagnostics, table, judgement, max_k_hat)
    with style():
        of_ranks = math.ceil(len(QUANTITY_NAMES) / GRID_COLUMNS)
        rows = of_ranks + math.ceil(len(PANELS) / GRID_COLUMNS)
        figure = new_figure(TEXT_WIDTH_IN, ROW_HEIGHT_IN * rows)
        grid = figure.subplots(rows, GRID_COLUMNS)
        ranks, others = grid[:of_ranks].flat, grid[of_ranks:].flat
        for index, name in enumerate(QUANTITY_NAMES):
            _ranks(ranks[index], case, index)
            ranks[index].set_title(f"({ascii_lowercase[index]}) {LABELS[name]}")
        for spare in ranks[len(QUANTITY_NAMES) :]:
            spare.remove()
        letters = ascii_lowercase[len(QUANTITY_NAMES) :]
        for axes, letter, (title, draw) in zip(others, letters, PANELS.items(), strict=False):
            draw(axes, case)
            axes.set_title(f"({letter}) {title}")
        for axes in grid[:of_ranks, 0]:
            axes.set_ylabel("ECDF of ranks $-$ uniform")
        title = f"Calibration of the experiment '{experiment}'"
        figure.suptitle(titled(title, f"contexts of the {cohort_title}"), fontsize=7.5)
        shared_legend(figure, [ranks[0], others[1], others[0]], entries_a_row=3)
    return figure


def _ranks(axes: Axes, case: CalibrationCase, index: int) -> None:
    ranked = case.ranked["model_noise"]
    for subject in dict.fromkeys(ranked.subject.tolist()):
        level = ranked.weighted.level[ranked.subject == subject, index]
        _line(axes, level, color=POSTERIOR, lw=0.4, alpha=0.35, label="weighted, one subject")
    _band(axes, len(ranked.truth), case.settings.alpha / len(ranked.names))
    for sampler in (NETWORK, WEIGHTED):
        _line(
            axes,
            ranked.of(sampler).level[:, index],
            color=SAMPLER_COLORS[sampler],
            label=SAMPLER_NAMES[sampler],
        )
    _level_axis(axes)


def _coverage(axes: Axes, case: CalibrationCase) -> None:
    ranked = case.ranked["model_noise"]
    _band(axes, len(ranked.truth), case.settings.alpha / len(ranked.names))
    for index, name in enumerate(PARAMETERS):
        _line(
            axes,
            central_level(ranked.weighted.level[:, index]),
            color=COLORS[name],
            lw=0.9,
            label=LABELS[name],
        )
    _level_axis(axes, "nominal level")
    axes.set_ylabel("coverage $-$ nominal")


def _joint(axes: Axes, case: CalibrationCase) -> None:
    own, acquired = case.ranked["model_noise"], case.ranked["sample_by_sample"]
    _band(axes, len(own.truth), case.settings.alpha)
    for sampler in (NETWORK, WEIGHTED):
        _line(axes, own.of(sampler).tarp, color=SAMPLER_COLORS[sampler])
    _line(
        axes, acquired.weighted.tarp, color=POSTERIOR, ls=":", lw=0.9, label="weighted, acquired recordings"
    )
    _level_axis(axes, "nominal level")


def _reported_coverage(axes: Axes, case: CalibrationCase) -> None:
    """Draw the coverage of the 90 % intervals with 95 % normal errors, over the 88 to 92 % asked for."""
    table = case.table[(case.table["subject"] == POOLED) & (case.table["test"] == SBC)]
    styles = [
        ("model_noise", NETWORK, "o"),
        ("model_noise", WEIGHTED, "o"),
        ("sample_by_sample", NETWORK, "s"),
        ("sample_by_sample", WEIGHTED, "s"),
    ]
    for offset, (recordings, sampler, marker) in enumerate(styles):
        rows = table[(table["recordings"] == recordings) & (table["sampler"] == sampler)].set_index(
            "quantity"
        )
        values, n = rows["coverage_90"].reindex(PARAMETERS), rows["n"].reindex(PARAMETERS)
        error = 1.96 * np.sqrt(values * (1.0 - values) / n)
        x = np.arange(len(PARAMETERS)) + 0.17 * (offset - 1.5)
        color = SAMPLER_COLORS[sampler]
        face = color if recordings == "model_noise" else "white"
        axes.errorbar(x, values, error, ls="", marker=marker, ms=2.6, lw=0.8, color=color, mfc=face, mew=0.8)
    axes.axhline(REPORTED, color=PRIOR, lw=0.8, ls="--", zorder=0)
    axes.axhspan(0.88, 0.92, color=BAND, lw=0, zorder=-1)
    axes.set_xticks(range(len(PARAMETERS)), [LABELS[name] for name in PARAMETERS])
    in_percent(axes.yaxis)
    axes.set_xlabel("open: acquired")


def _efficiency(axes: Axes, case: CalibrationCase) -> None:
    diagnostics = case.diagnostics
    axes.hist(diagnostics.efficiency, bins=np.linspace(0.0, 1.0, 41).tolist(), color=POSTERIOR, alpha=0.8)
    median = float(np.median(diagnostics.efficiency))
    axes.axvline(median, 0.0, 0.66, color=OBSERVED, lw=0.8, ls="--")
    high = float(np.mean(diagnostics.k_hat > case.max_k_hat))
    text = (
        f"median {share(median, 0)}\n"
        rf"$\hat{{k}}$ > {case.max_k_hat:g}: {share(high)}" + "\n"
        f"MCMC: {int(diagnostics.by_mcmc.sum())} of {len(diagnostics.by_mcmc)}"
    )
    axes.text(0.04, 0.96, text, transform=axes.transAxes, va="top", fontsize=6.0)
    in_percent(axes.xaxis)
    axes.set_ylim(0.0, 1.5 * axes.get_ylim()[1])
    axes.set_xlabel("importance efficiency")
    axes.set_ylabel("recordings")


def _local(axes: Axes, case: CalibrationCase) -> None:
    table = case.table[(case.table["recordings"] == LOCAL) & case.table["test"].isin([SBC, TARP])]
    subjects = list(dict.fromkeys(table["subject"]))
    for offset, sampler in ((-0.16, NETWORK), (0.16, WEIGHTED)):
        rows = table[table["sampler"] == sampler]
        x = [subjects.index(name) + offset for name in rows["subject"]]
        axes.plot(x, rows["p_value"], ls="", marker="o", ms=2.2, color=SAMPLER_COLORS[sampler], alpha=0.8)
    axes.axhline(float(table[table["test"] == SBC]["limit"].min()), color=PRIOR, lw=0.8, ls="--", zorder=0)
    axes.set_yscale("log")
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    _subject_axis(axes, subjects)
    axes.set_ylabel("p-value")


def _two_samples(axes: Axes, case: CalibrationCase) -> None:
    table = case.table[case.table["test"] == C2ST]
    subjects = list(dict.fromkeys(table["subject"]))
    for sampler in (NETWORK, WEIGHTED):
        rows = table[table["sampler"] == f"{sampler} mcmc"]
        x = [subjects.index(name) for name in rows["subject"]]
        axes.plot(x, rows["statistic"], ls="", marker="o", ms=3.0, color=SAMPLER_COLORS[sampler])
    axes.axhline(0.5, color=PRIOR, lw=0.8, zorder=0)
    axes.axhline(case.settings.max_c2st, color=PRIOR, lw=0.8, ls="--", zorder=0)
    _subject_axis(axes, subjects)
    axes.set_ylabel("accuracy")


PANELS: Final[Mapping[str, Callable[[Axes, CalibrationCase], None]]] = {
    "intervals, weighted": _coverage,
    "joint regions (TARP)": _joint,
    "90 % intervals": _reported_coverage,
    "weights": _efficiency,
    "local calibration": _local,
    "C2ST with MCMC": _two_samples,
}
"""Titles and drawings of the panels behind those of the ranks."""


def _line(axes: Axes, level: FloatArray, **look: object) -> None:
    difference = np.concatenate([[0.0], uniformity(level).difference, [0.0]])
    axes.plot(_with_ends(), difference, **look)  # type: ignore[arg-type]


def _band(axes: Axes, n: int, level: float) -> None:
    low, high = (np.concatenate([[0.0], limit, [0.0]]) for limit in band(n, level))
    axes.fill_between(
        _with_ends(), low, high, color=BAND, lw=0, zorder=-1, label="simultaneous 95 % band, pooled"
    )


def _with_ends() -> FloatArray:
    return np.concatenate([[0.0], points(), [1.0]])


def _level_axis(axes: Axes, label: str = "") -> None:
    axes.set_xlim(0.0, 1.0)
    axes.set_xticks([0.0, 0.5, 1.0], ["0", "0.5", "1"])
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.set_xlabel(label)


def _subject_axis(axes: Axes, subjects: list[str]) -> None:
    named = len(subjects) <= 12
    axes.set_xticks(range(len(subjects)) if named else [], subjects if named else [])
    axes.set_xlim(-0.5, len(subjects) - 0.5)
    axes.set_xlabel("subject")
