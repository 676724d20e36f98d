"""A proposal about the posterior's mode, for a recording of which a network knows nothing.

CMA-ES (Hansen 2006, in: Towards a New Evolutionary Computation, as implemented in the library ``cma``) climbs
the log posterior in the logit of the prior's box. The covariance that it learns on the way has the shape of
the posterior about its mode; its size is set by how far the posterior falls.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.stats import chi2

from swesbi.arrays import FloatArray
from swesbi.evolution import library_options
from swesbi.posterior.importance import LikelihoodModel
from swesbi.posterior.space import log_posterior_of_logit
from swesbi.posterior.student import RIDGE, WIDENING, StudentProposal

POPULATION: Final = 64  # simulations of a generation, which run together
GENERATIONS: Final = 200
FIRST_STEP: Final = 0.5  # in eta
SETTLED: Final = {"tolfun": 0.01, "tolfunhist": 0.01}
"""Of the log posterior: a search that gains no more has arrived."""
FAILED: Final = 1e6  # minus log posterior of a simulation that failed: finite, and worse than any
PROBES: Final = 256
PROBE_ROUNDS: Final = 6  # of finding the size; each multiplies it by at most ``LARGEST_FACTOR``
LARGEST_FACTOR: Final = 30.0


def mode_proposal(model: LikelihoodModel, start: FloatArray, seed: int) -> StudentProposal:
    """Return a Student distribution of eta about the mode that is reached from ``start``.

    Args:
        model: Prior and exact likelihood of the recording.
        start: eta with a likelihood; shape (d,).
        seed: Seed of search and probes.
    """
    rng = np.random.default_rng(seed)
    mode, shape = _climb(model, start, rng)
    size = _size(model, mode, shape, rng)
    return StudentProposal(mode, WIDENING * size * shape + RIDGE * np.eye(len(mode)))


def _climb(
    model: LikelihoodModel, start: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Return the best eta (d,), and the shape (d, d) of the search about it, of determinant one."""
    import cma  # it loads pyplot, and most who import this module never climb

    evolution = cma.CMAEvolutionStrategy(
        start, FIRST_STEP, SETTLED | library_options(POPULATION, GENERATIONS, rng)
    )
    while not evolution.stop():
        population = evolution.ask()
        height = log_posterior_of_logit(model, np.array(population))
        evolution.tell(population, np.where(np.isfinite(height), -height, FAILED).tolist())
    covariance = np.asarray(evolution.C)
    _, log_determinant = np.linalg.slogdet(covariance)
    return np.asarray(evolution.best.x), covariance / np.exp(log_determinant / len(start))


def _size(model: LikelihoodModel, mode: FloatArray, shape: FloatArray, rng: np.random.Generator) -> float:
    """Return the variance t for which the posterior falls from the mode as a normal one does.

    Of eta ~ N(mode, t shape) a normal log posterior falls by half a chi-square of d degrees of freedom; the
    medians are compared, which simulations that fail leave alone.
    """
    wanted = 0.5 * float(chi2.median(len(mode)))
    top = float(log_posterior_of_logit(model, mode[None])[0])
    directions = rng.multivariate_normal(np.zeros(len(mode)), shape, PROBES)
    size = FIRST_STEP**2
    for _ in range(PROBE_ROUNDS):
        fall = top - log_posterior_of_logit(model, mode + np.sqrt(size) * directions)
        found = float(np.median(np.where(np.isfinite(fall), fall, FAILED)))
        # a fall that is quadratic in eta is linear in the variance
        size *= float(np.clip(wanted / max(found, 1e-9), 1.0 / LARGEST_FACTOR, LARGEST_FACTOR))
    return size
