"""The history of one CMA-ES run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class CmaesRun:
    """The history of one seed; G is the permitted number of generations, NaN after an early stop.

    Attributes:
        seed: Its seed.
        best_loss: (G,) lowest loss found up to each generation.
        best_theta: (G, 3) its theta.
        evaluations: (G,) simulations run up to each generation; constant after an early stop.
        generations: Generations run.
        stop: Why the run ended, in the library's words.
    """

    seed: int
    best_loss: FloatArray
    best_theta: FloatArray
    evaluations: NDArray[np.int64]
    generations: int
    stop: str

    @property
    def loss(self) -> float:
        """Lowest loss of the run."""
        return float(self.best_loss[self.generations - 1])

    @property
    def theta(self) -> FloatArray:
        """Theta of the lowest loss, shape (3,)."""
        theta: FloatArray = self.best_theta[self.generations - 1]
        return theta


def best_run(runs: list[CmaesRun]) -> int:
    """Return the index of the run with the lowest loss; the first of equals."""
    return int(np.argmin([run.loss for run in runs]))
