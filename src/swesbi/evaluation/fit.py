"""The CMA-ES reference fit of one subject: every run's history, and the best theta with its curve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.evaluation.cmaes_run import CmaesRun, best_run
from swesbi.evaluation.scores import rmse

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class CmaesFit:
    """R runs of at most G generations, and the best of them.

    Attributes:
        seed: (R,) seed of each run.
        best_loss: (R, G) lowest loss up to each generation; NaN after an early stop.
        best_theta: (R, G, 3) its theta.
        evaluations: (R, G) simulations up to each generation.
        generations: (R,) generations run.
        run_loss: (R,) lowest loss of each run.
        run_theta: (R, 3) theta of that loss.
        stop: Why each run ended.
        theta: (3,) theta of the lowest loss of all.
        loss: That loss.
        best_seed: Its seed.
        grid: (grid,) analysis phases.
        curve_kpa: (grid,) its total stiffness curve, as measured.
        rmse_kpa: RMSE of that curve against the observed one.
    """

    seed: NDArray[np.int64]
    best_loss: FloatArray
    best_theta: FloatArray
    evaluations: NDArray[np.int64]
    generations: NDArray[np.int64]
    run_loss: FloatArray
    run_theta: FloatArray
    stop: tuple[str, ...]
    theta: FloatArray
    loss: float
    best_seed: int
    grid: FloatArray
    curve_kpa: FloatArray
    rmse_kpa: float


def gather(
    runs: list[CmaesRun], curve_kpa: FloatArray, grid: FloatArray, observed_kpa: FloatArray
) -> CmaesFit:
    """Gather the runs; ``curve_kpa`` is the curve of the best run's theta, all curves of shape (grid,)."""
    best = runs[best_run(runs)]
    return CmaesFit(
        seed=np.array([run.seed for run in runs]),
        best_loss=np.stack([run.best_loss for run in runs]),
        best_theta=np.stack([run.best_theta for run in runs]),
        evaluations=np.stack([run.evaluations for run in runs]),
        generations=np.array([run.generations for run in runs]),
        run_loss=np.array([run.loss for run in runs]),
        run_theta=np.stack([run.theta for run in runs]),
        stop=tuple(run.stop for run in runs),
        theta=best.theta,
        loss=best.loss,
        best_seed=best.seed,
        grid=grid,
        curve_kpa=curve_kpa,
        rmse_kpa=rmse(observed_kpa, curve_kpa),
    )
