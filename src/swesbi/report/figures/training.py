"""Training of an estimator: its losses; the table of what inference says after each epoch."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from swesbi.artefacts.csv import checked, read_csv
from swesbi.report.figures.style import (
    CMAES,
    POSTERIOR,
    PRIOR,
    TEXT_WIDTH_IN,
    new_figure,
    shared_legend,
    style,
    titled,
)

HISTORY_COLUMNS: Final = ("epoch", "training_loss", "validation_loss")
HEIGHT_IN = 2.4
EPOCH_COLUMNS: Final = (
    "epoch", "best", "quantity", "subject", "parameter", "value", "ci_low", "ci_high", "n",
)  # fmt: skip


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
