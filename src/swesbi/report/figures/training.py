"""Training of an estimator: its losses."""

from __future__ import annotations

import numpy as np

from swesbi.networks.training import TrainingTable
from swesbi.report.figures.style import (
    NETWORK,
    PRIOR,
    TEXT_WIDTH_IN,
    Drawing,
    drawing,
    few_ticks,
    shared_legend,
    titled,
)


def draw_training(training: TrainingTable, *, trained_on: str) -> Drawing:
    """Draw both losses, mean -log q(theta | z) per row, with the epoch of the lowest validation loss."""
    epoch = training["epoch"].to_numpy()
    best = int(np.argmin(training["validation_loss"].to_numpy()))
    title = titled("Training of the estimator", trained_on)
    with drawing(TEXT_WIDTH_IN, 2.4, title) as figure:
        axes = figure.subplots()
        axes.plot(epoch, training["training_loss"], color=NETWORK, label="training")
        axes.plot(epoch, training["validation_loss"], color=NETWORK, ls="--", alpha=0.6, label="validation")
        label = f"lowest validation loss (epoch {int(epoch[best])})"
        axes.axvline(epoch[best], color=PRIOR, lw=0.8, ls=":", label=label)
        axes.xaxis.set_major_locator(few_ticks(integer=True))
        axes.set(
            xlabel="epoch: passes over the training set",
            ylabel=r"loss, mean $-\log\,q(\theta\,|\,z)$",
        )
        shared_legend(figure, [axes], entries_a_row=3)
    return figure
