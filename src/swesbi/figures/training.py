"""Training and validation loss of an estimator, epoch by epoch."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from swesbi.artefacts import ArtefactError
from swesbi.figures.layout import shared_legend
from swesbi.figures.style import CMAES, POSTERIOR, PRIOR, TEXT_WIDTH_IN, new_figure, style
from swesbi.figures.text import titled

COLUMNS: Final = ("epoch", "training_loss", "validation_loss")
HEIGHT_IN = 2.4


def read_history(path: Path) -> pd.DataFrame:
    """Read ``training.csv``.

    Raises:
        ArtefactError: A column or every row is missing.
    """
    history = pd.read_csv(path)
    if missing := [name for name in COLUMNS if name not in history.columns]:
        raise ArtefactError(f"{path}: lacks the columns {', '.join(missing)}; delete it and rerun")
    if history.empty:
        raise ArtefactError(f"{path}: holds no epoch; delete it and rerun")
    return history


def draw(history: pd.DataFrame, cohort_title: str) -> Figure:
    """Draw both losses, mean -log q(theta | z) per row, with the epoch of the lowest validation loss.

    Args:
        history: One row an epoch, with the columns ``COLUMNS``.
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
