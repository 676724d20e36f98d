"""Training of an estimator: its losses, and what inference says after each epoch."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter

from swesbi.artefacts.csv import checked, read_csv
from swesbi.parameters import THETA_NAMES, THETA_SYMBOLS
from swesbi.report.figures.style import (
    CMAES,
    NETWORK,
    POSTERIOR,
    PRIOR,
    TEXT_WIDTH_IN,
    TRUTH,
    in_percent,
    new_figure,
    shared_legend,
    style,
    titled,
)
from swesbi.report.numbers import as_percent
from swesbi.report.training_tables import COVERAGE_PHASES, FRESH_LOSS, RECOVERY_COVERAGE, RELATIVE_SD

HISTORY_COLUMNS: Final = ("epoch", "training_loss", "validation_loss")
HEIGHT_IN = 2.4
EPOCHS_HEIGHT_IN: Final = 4.2
MARKER_SIZE: Final = 2.8
EPOCH_COLUMNS: Final = (
    "epoch", "best", "quantity", "subject", "parameter", "value", "ci_low", "ci_high", "n",
)  # fmt: skip
PARAMETER_LOOKS: Final = tuple(
    zip(THETA_SYMBOLS, cycle((POSTERIOR, CMAES, TRUTH, NETWORK)), cycle("os^D"), strict=False)
)
SUBJECT_MARKERS: Final = "osD^vPX*"
NAMED_SUBJECTS: Final = len(SUBJECT_MARKERS)


def read_history(path: Path) -> pd.DataFrame:
    """Read ``training.csv``.

    Raises:
        ArtefactError: A column or every row is missing.
    """
    return checked(read_csv(path), path, HISTORY_COLUMNS, "epoch")


def draw_training(history: pd.DataFrame, cohort_title: str) -> Figure:
    """Draw both losses, mean -log q(theta | z) per row, with the epoch of the lowest validation loss.

    Args:
        history: One row an epoch, with the columns ``HISTORY_COLUMNS``.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    epoch = history["epoch"].to_numpy()
    best = int(np.argmin(history["validation_loss"].to_numpy()))
    with style():
        figure = new_figure(TEXT_WIDTH_IN, HEIGHT_IN)
        axes = figure.subplots()
        axes.plot(epoch, history["training_loss"], color=POSTERIOR, label="training")
        axes.plot(epoch, history["validation_loss"], color=CMAES, ls="--", label="validation")
        label = f"lowest validation loss (epoch {int(epoch[best])})"
        axes.axvline(epoch[best], color=PRIOR, lw=0.8, ls=":", label=label)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlabel("epoch")
        axes.set_ylabel(r"loss, mean $-\log\,q(\theta\,|\,z)$")
        figure.suptitle(titled("Training of the estimator", cohort_title), fontsize=7.5)
        shared_legend(figure, [axes], entries_a_row=3)
    return figure


def read_epochs(path: Path) -> pd.DataFrame:
    """Read ``epochs.csv``.

    Raises:
        ArtefactError: A column or every row is missing.
    """
    return checked(read_csv(path, ("parameter",)), path, EPOCH_COLUMNS, "epoch")


def draw_epochs(
    table: pd.DataFrame, history: pd.DataFrame, interval: float, cohort_title: str, experiment: str
) -> Figure:
    """Draw four panels against the epoch, on a logarithmic axis.

    Args:
        table: The rows of ``epochs.csv``.
        history: The rows of ``training.csv``: the loss of every epoch.
        interval: Mass of the intervals whose coverage is shown.
        cohort_title: What the subjects are ("virtual volunteers").
        experiment: Name of the experiment.
    """
    with style():
        figure = new_figure(TEXT_WIDTH_IN, EPOCHS_HEIGHT_IN)
        loss, recovery, observed, width = figure.subplots(2, 2, sharex=True).flat
        _loss(loss, history, table)
        _recovery(recovery, table, interval)
        _observed(observed, table, interval)
        _width(width, table)
        best = int(table["epoch"][table["best"] == 1].iloc[0])
        for axes in (loss, recovery, observed, width):
            axes.axvline(best, color=PRIOR, lw=0.8, ls=":", zorder=0)
        loss.annotate(
            f"best: {best}", (best, 1.0), xycoords=("data", "axes fraction"), color="#5A5A5A",
            xytext=(-2, -1), textcoords="offset points", ha="right", va="top", fontsize=6.5,
        )  # fmt: skip
        _epoch_axis((observed, width), int(history["epoch"].max()))
        title = f"Training of the experiment '{experiment}', epoch by epoch"
        figure.suptitle(titled(title, cohort_title), fontsize=7.5)
    return figure


def _loss(axes: Axes, history: pd.DataFrame, table: pd.DataFrame) -> None:
    fresh = table[table["quantity"] == FRESH_LOSS]
    error = (fresh["value"] - fresh["ci_low"], fresh["ci_high"] - fresh["value"])
    axes.plot(history["epoch"], history["training_loss"], color=PRIOR, label="training")
    axes.plot(history["epoch"], history["validation_loss"], color="black", lw=0.9, label="validation")
    axes.errorbar(
        fresh["epoch"], fresh["value"], error, color=CMAES, ls="", marker="o", ms=MARKER_SIZE, lw=0.8,
        label="parameters never seen",
    )  # fmt: skip
    axes.set_ylabel(r"mean $-\log\,q(\theta\,|\,z)$")
    axes.set_title("(a) loss")
    axes.legend(loc="lower left")


def _recovery(axes: Axes, table: pd.DataFrame, interval: float) -> None:
    rows = table[table["quantity"] == RECOVERY_COVERAGE]
    for name, (label, color, marker) in zip(THETA_NAMES, PARAMETER_LOOKS, strict=True):
        curve = rows[rows["parameter"] == name]
        axes.plot(curve["epoch"], curve["value"], color=color, marker=marker, ms=MARKER_SIZE, label=label)
        axes.fill_between(curve["epoch"], curve["ci_low"], curve["ci_high"], color=color, alpha=0.15, lw=0)
    _coverage_axis(axes, interval)
    axes.set_ylim(min(0.7, float(rows["ci_low"].min())) - 0.02, 1.01)
    axes.set_ylabel("truth in the credible interval")
    axes.set_title("(b) recovery of synthetic recordings")
    axes.legend(loc="lower right", ncols=3, columnspacing=1.0)


def _observed(axes: Axes, table: pd.DataFrame, interval: float) -> None:
    subjects = _scored_subjects(table)
    for index, name in enumerate(subjects):
        curve = table[(table["quantity"] == COVERAGE_PHASES) & (table["subject"] == name)]
        marker = SUBJECT_MARKERS[index] if len(subjects) <= NAMED_SUBJECTS else ""
        label = name if len(subjects) <= NAMED_SUBJECTS else None
        axes.plot(
            curve["epoch"], curve["value"], color=POSTERIOR, alpha=0.85, lw=0.8, marker=marker,
            ms=MARKER_SIZE, mfc="white", mew=0.8, label=label,
        )  # fmt: skip
    _coverage_axis(axes, interval)
    axes.set_ylim(-0.03, 1.03)
    axes.set_ylabel("phases in the noiseless band")
    axes.set_title("(c) recordings, prior-supported subjects")
    if not subjects:
        axes.text(
            0.5, 0.5, "no prior-supported subject", transform=axes.transAxes, ha="center", color="#5A5A5A"
        )
    elif len(subjects) <= NAMED_SUBJECTS:
        axes.legend(loc="upper right", bbox_to_anchor=(1.0, 0.88), ncols=2, columnspacing=1.0)


def _width(axes: Axes, table: pd.DataFrame) -> None:
    rows = table[(table["quantity"] == RELATIVE_SD) & table["subject"].isin(_scored_subjects(table))]
    for name, (label, color, marker) in zip(THETA_NAMES, PARAMETER_LOOKS, strict=True):
        widths = rows[rows["parameter"] == name].pivot(index="epoch", columns="subject", values="value")
        axes.plot(widths.index, widths.to_numpy(), color=color, lw=0.4, alpha=0.5)
        axes.plot(
            widths.index, widths.median(axis=1), color=color, marker=marker, ms=MARKER_SIZE, label=label
        )
    axes.set_yscale("log")
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: as_percent(round(value, 6))))
    axes.set_ylabel("posterior sd / prior sd")
    axes.set_title("(d) width (thin: each subject)")
    if len(rows):
        axes.legend(loc="lower left", ncols=3, columnspacing=1.0)


def _scored_subjects(table: pd.DataFrame) -> list[str]:
    rows = table[(table["quantity"] == COVERAGE_PHASES) & table["value"].notna()]
    return list(dict.fromkeys(rows["subject"]))


def _coverage_axis(axes: Axes, interval: float) -> None:
    axes.axhline(interval, color=PRIOR, lw=0.8, ls="--", zorder=0)
    in_percent(axes.yaxis)


def _epoch_axis(axes: Sequence[Axes], last: int) -> None:
    ticks = [tick for tick in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000) if tick <= last]
    for panel in axes:
        panel.set_xscale("log")
        panel.set_xticks(ticks, [str(tick) for tick in ticks])
        panel.xaxis.set_minor_formatter(NullFormatter())
        panel.set_xlim(0.93, last * 1.08)
        panel.set_xlabel("epoch")
