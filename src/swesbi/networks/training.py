"""What trainings of both networks share: torch that repeats, a record of the epochs, tables of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Annotated, Final

import pandas as pd

from swesbi.artefacts.csv import Table
from swesbi.base.progress import Progress


@contextmanager
def reproducible(seed: int) -> Iterator[None]:
    """Run the block under this seed on one thread.

    Sums split over threads differ in the last bit, so another number of threads would train another
    network; and these small networks run no faster on several.
    """
    import torch  # here alone: tables of trainings are read without it

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with torch.random.fork_rng():
            torch.manual_seed(seed)
            yield
    finally:
        torch.set_num_threads(threads)


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


@dataclass(frozen=True)
class FlowEpoch(Epoch):
    """One epoch of a flow, with the number of batches that were left out."""

    skipped_batches: int


class EpochRecord:
    """Collects the epochs of a training and logs a line for each."""

    def __init__(self, label: str, at_most: int, kind: type[Epoch] = Epoch) -> None:
        self.epochs: list[Epoch] = []
        self.best_loss = float("inf")
        self._kind = kind
        self._progress = Progress(label, at_most, unit="epoch", every_s=0.0)

    @property
    def best(self) -> Epoch:
        """That of the lowest validation loss so far."""
        return [epoch for epoch in self.epochs if epoch.best_so_far][-1]

    def add(self, training_loss: float, validation_loss: float, seconds: float, **more: int) -> Epoch:
        """Take in one epoch, with what else its kind has."""
        improved = validation_loss < self.best_loss
        epoch = self._kind(len(self.epochs) + 1, training_loss, validation_loss, improved, **more)
        self.epochs.append(epoch)
        if improved:
            self.best_loss = validation_loss
        losses = f"loss {training_loss:.4f}, validation {validation_loss:.4f}{' (best)' if improved else ''}"
        self._progress.step(note=f"{losses}, {seconds:.1f} s")
        return epoch


def losses_table(epochs: Sequence[Epoch]) -> pd.DataFrame:
    """Return the losses of every epoch of a training, as ``training.csv`` has them."""
    frame = pd.DataFrame([asdict(epoch) for epoch in epochs]).rename(columns={"number": "epoch"})
    return frame.assign(best_so_far=frame["best_so_far"].astype(int))
