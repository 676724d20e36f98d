"""CMA-ES fit of theta to an observed curve: the optimisation-based point reference.

Hansen (2006), as implemented in the library ``cma``. The search runs in u = log(theta / low) /
log(high / low), so the box of the prior's bounds becomes the unit cube and one initial step serves
the three parameters.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cma
import numpy as np
from numpy.typing import NDArray

from swesbi.evaluation.cmaes_run import CmaesRun
from swesbi.evaluation.settings import CmaesSettings
from swesbi.parameters import THETA
from swesbi.progress import Progress
from swesbi.seeds import generator

FloatArray = NDArray[np.float64]
Loss = Callable[[FloatArray], FloatArray]
"""Maps theta of shape (n, 3) to losses of shape (n,): a whole population in one call."""


def search(
    loss: Loss, low: FloatArray, high: FloatArray, settings: CmaesSettings, label: str = "cmaes"
) -> list[CmaesRun]:
    """Run CMA-ES once for every seed of the settings, in their order.

    Args:
        loss: Maps theta (n, 3) to losses (n,).
        low: (3,) lower bounds of theta, positive.
        high: (3,) upper bounds of theta.
        settings: Seeds, population, generations and initial step.
        label: What the progress line calls the search.
    """
    progress = Progress(label, total=len(settings.seeds), unit="run")
    runs = []
    for seed in settings.seeds:
        runs.append(_run(loss, low, high, settings, seed))
        progress.step(note=f"seed {seed}: loss {runs[-1].loss:.5f}, {runs[-1].stop}")
    return runs


def _run(loss: Loss, low: FloatArray, high: FloatArray, settings: CmaesSettings, seed: int) -> CmaesRun:
    rng = generator(seed, "cmaes")
    evolution = cma.CMAEvolutionStrategy(rng.random(len(THETA)), settings.sigma0, _options(settings, rng))
    losses, thetas = [], []
    best_loss, best_theta = np.inf, np.full(3, np.nan)
    while not evolution.stop():
        population = evolution.ask()
        theta = to_theta(np.array(population), low, high)
        values = loss(theta)
        evolution.tell(population, values.tolist())
        index = int(np.argmin(values))
        if values[index] < best_loss:
            best_loss, best_theta = float(values[index]), theta[index]
        losses.append(best_loss)
        thetas.append(best_theta)
    return _padded(seed, losses, thetas, settings, _reason(evolution.stop()))


def to_theta(u: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Map u in [0, 1]^3, shape (n, 3), to theta within its bounds: theta = low (high / low)^u."""
    return np.clip(low * (high / low) ** u, low, high)


def _options(settings: CmaesSettings, rng: np.random.Generator) -> dict[str, Any]:
    """Options of the library: a random stream of our own, silence, no files."""
    return {
        "bounds": [0.0, 1.0],
        "popsize": settings.population_size,
        "maxiter": settings.generations,
        "randn": lambda *shape: rng.standard_normal(shape),
        "seed": np.nan,  # leaves NumPy's global random state alone
        "verbose": -9,
        "verb_log": 0,
        "verb_disp": 0,
    }


def _reason(stop: dict[str, Any]) -> str:
    return ", ".join(sorted(map(str, stop)))


def _padded(
    seed: int, losses: list[float], thetas: list[FloatArray], settings: CmaesSettings, stop: str
) -> CmaesRun:
    missing = settings.generations - len(losses)
    evaluations = settings.population_size * np.arange(1, len(losses) + 1)
    return CmaesRun(
        seed=seed,
        best_loss=np.pad(np.array(losses), (0, missing), constant_values=np.nan),
        best_theta=np.pad(np.array(thetas), ((0, missing), (0, 0)), constant_values=np.nan),
        evaluations=np.pad(evaluations, (0, missing), mode="edge"),
        generations=len(losses),
        stop=stop,
    )
