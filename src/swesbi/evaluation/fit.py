"""The CMA-ES reference fit of one subject: every run's history, and the best theta with its curve."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import Labels, Variable
from swesbi.evaluation.cmaes_run import CmaesRun, best_run
from swesbi.evaluation.scores import rmse
from swesbi.parameters import THETA_COLUMNS

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class CmaesFit:
    """R runs of at most G generations, NaN after an early stop, and the best of them."""

    seed: Annotated[NDArray[np.int64], Variable("run", "1", "seed of each run")]
    best_loss: Annotated[FloatArray, Variable("run generation", "1", "lowest loss up to each generation")]
    best_theta: Annotated[FloatArray, Variable("run generation parameter", THETA_COLUMNS, "its parameters")]
    evaluations: Annotated[
        NDArray[np.int64], Variable("run generation", "1", "simulations up to each generation")
    ]
    generations: Annotated[NDArray[np.int64], Variable("run", "1", "generations run")]
    run_loss: Annotated[FloatArray, Variable("run", "1", "lowest loss of each run")]
    run_theta: Annotated[FloatArray, Variable("run parameter", THETA_COLUMNS, "parameters of that loss")]
    stop: Annotated[tuple[str, ...], Labels("run", "stop")]
    theta: Annotated[FloatArray, Variable("parameter", THETA_COLUMNS, "parameters of the best run")]
    loss: Annotated[float, Variable("", "1", "loss of the best run")]
    best_seed: Annotated[int, Variable("", "1", "seed of the best run")]
    grid: Annotated[
        FloatArray, Variable("grid", "1", "analysis phases, fraction of the cycle from the R peak")
    ]
    curve_kpa: Annotated[
        FloatArray, Variable("grid", "kPa", "total stiffness of the best theta, as measured")
    ]
    rmse_kpa: Annotated[float, Variable("", "kPa", "RMSE of that curve against the observed one")]


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
