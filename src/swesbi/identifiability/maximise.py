"""Maximising the likelihood of many starting points or held parameters at once, by damped Fisher scoring."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.identifiability.normal import (
    MomentFunction,
    differentiate,
    information_by_datum,
    log_likelihood_terms,
    score,
)

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

MAXIMUM_ROUNDS: Final = 60
TOLERANCE: Final = 1e-4  # of the log likelihood; likelihood-ratio levels differ by more than 0.2
FIRST_DAMPING: Final = 1e-2
GREATEST_DAMPING: Final = 1e8
EASE: Final = 0.2
HARDEN: Final = 5.0


@dataclass(frozen=True)
class NormalProblem:
    """Normal data and the box in which their parameters are searched.

    Attributes:
        moments: Parameters (n, k) to mean and log sd of the data.
        observed: The data; (p,).
        low: Lower bounds of the search; (k,).
        high: Upper bounds; (k,).
        step: Step of the differences.
    """

    moments: MomentFunction
    observed: FloatArray
    low: FloatArray
    high: FloatArray
    step: float

    def log_likelihood(self, x: FloatArray) -> FloatArray:
        """Return log L of parameters (n, k), shape (n,); -inf where the moments are undefined."""
        total = log_likelihood_terms(self.moments(x), self.observed).sum(axis=1)
        return np.where(np.isnan(total), -np.inf, total)


@dataclass(frozen=True)
class Maxima:
    """Where n searches ended: x (n, k), log L (n,), and whether no further gain was in sight (n,)."""

    x: FloatArray
    log_likelihood: FloatArray
    converged: BoolArray

    @property
    def best(self) -> int:
        """The row of the highest likelihood."""
        return int(np.argmax(self.log_likelihood))


def maximise(problem: NormalProblem, start: FloatArray, free: Sequence[int]) -> Maxima:
    """Climb from every row of ``start`` (n, k) along the ``free`` coordinates, the others held.

    Fisher scoring with Levenberg's and Marquardt's damping: a step solves (I + damping diag I) d = score
    and counts only if the likelihood rises, so the result is never below the start. A coordinate on its
    bound whose score points outward rests. A search ends where the step, were it not damped, promises less
    than ``TOLERANCE``.
    """
    x = np.clip(start, problem.low, problem.high)
    value = problem.log_likelihood(x)
    damping = np.full(len(x), FIRST_DAMPING)
    done = ~np.isfinite(value)
    gradient, information = np.zeros((len(x), len(free))), np.zeros((len(x), len(free), len(free)))
    stale = ~done
    for _ in range(MAXIMUM_ROUNDS):
        if stale.any():
            at = differentiate(problem.moments, x[stale], problem.step, free)
            gradient[stale] = np.nan_to_num(score(at, problem.observed))
            information[stale] = np.nan_to_num(information_by_datum(at).sum(axis=1))
        rows = np.flatnonzero(~done)
        trial, promise = _step(problem, x[rows], gradient[rows], information[rows], damping[rows], free)
        done[rows] = (promise * (1.0 + damping[rows]) < TOLERANCE) | (damping[rows] > GREATEST_DAMPING)
        rows, trial = rows[~done[rows]], trial[~done[rows]]
        if not rows.size:
            break
        reached = problem.log_likelihood(trial)
        better = reached > value[rows]
        x[rows[better]], value[rows[better]] = trial[better], reached[better]
        damping[rows] *= np.where(better, EASE, HARDEN)
        stale = np.zeros_like(done)
        stale[rows[better]] = True
    return Maxima(x, value, done & np.isfinite(value))


def _step(
    problem: NormalProblem,
    x: FloatArray,
    gradient: FloatArray,
    information: FloatArray,
    damping: FloatArray,
    free: Sequence[int],
) -> tuple[FloatArray, FloatArray]:
    """Return where the damped steps lead, inside the box, and the gain that they promise."""
    columns = list(free)
    low, high = problem.low[columns], problem.high[columns]
    resting = ((x[:, columns] <= low) & (gradient < 0)) | ((x[:, columns] >= high) & (gradient > 0))
    slope = np.where(resting, 0.0, gradient)
    matrix = np.where(resting[:, :, None] | resting[:, None, :], 0.0, information)
    diagonal = np.diagonal(matrix, axis1=1, axis2=2)
    extra = damping[:, None] * diagonal + np.where(diagonal > 0.0, 0.0, 1.0)
    direction = np.linalg.solve(matrix + extra[:, :, None] * np.eye(len(columns)), slope[:, :, None])[:, :, 0]
    trial = x.copy()
    trial[:, columns] = np.clip(x[:, columns] + direction, low, high)
    return trial, np.einsum("nj,nj->n", slope, trial[:, columns] - x[:, columns])
