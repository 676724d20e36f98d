"""Tables of trainings, epoch by epoch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Annotated, Final

import pandas as pd

from swesbi.artefacts.csv import Table

VALIDATION_LOSS: Final = "validation_loss"
FRESH_LOSS: Final = "fresh_loss"
RECOVERY_COVERAGE: Final = "recovery_coverage"
RELATIVE_SD: Final = "posterior_sd_over_prior_sd"
IN_PRIOR: Final = "in_prior_share"
COVERAGE_PHASES: Final = "coverage_phases"
COVERAGE_GRID: Final = "coverage_grid"
RMSE: Final = "rmse_kpa"
TRAINING: Final = Table(columns=("epoch", "training_loss", "validation_loss"), row="epoch", digits=None)
TrainingTable = Annotated[pd.DataFrame, TRAINING]
"""``training.csv``: one row an epoch."""
EPOCHS: Final = Table(
    columns=(
        "epoch", "best", "quantity", "subject", "parameter", "value", "ci_low", "ci_high", "n",
    ),
    texts=("parameter",),
    row="epoch",
)  # fmt: skip
EpochsTable = Annotated[pd.DataFrame, EPOCHS]
"""``epochs.csv``: what inference says after each epoch that is looked at."""


@dataclass(frozen=True)
class Epoch:
    """One epoch of training: its number from 1 and mean -log q over training and held-out rows."""

    number: int
    training_loss: float
    validation_loss: float
    best_so_far: bool


def losses_table(epochs: Sequence[Epoch]) -> pd.DataFrame:
    """Return the losses of every epoch of a training, as ``training.csv`` has them."""
    frame = pd.DataFrame([asdict(epoch) for epoch in epochs]).rename(columns={"number": "epoch"})
    return frame.assign(best_so_far=frame["best_so_far"].astype(int))
