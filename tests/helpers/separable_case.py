"""The posterior of a population without recycling, where nobody is an outlier: parameters are then apart.

Each parameter of theta has its own median, spread and factors, so few hyperparameters at a time are drawn
from the hyperprior and weighted by an evidence that is known.
"""

from __future__ import annotations

from collections.abc import Callable

import hierarchy_case as case
import numpy as np
from scipy.special import softmax

from swesbi.base.arrays import FloatArray
from swesbi.persons.cohort.cohort import Design, Hyperprior, in_rows
from swesbi.persons.cohort.model import population_law
from swesbi.prior import draw_prior

Evidence = Callable[[int, FloatArray, FloatArray], FloatArray]
"""Log evidence (m, d) of each person's data on a parameter, by its number, mean (m, d) and spread (m,)."""
PROPOSED = 100_000
LEAST_EFFECTIVE = 500
DRAWS = 2000


def draw_eta(prior: Hyperprior, design: Design, evidence: Evidence, rng: np.random.Generator) -> FloatArray:
    """Draw hyperparameters (DRAWS, k), each parameter of theta apart."""
    rows = in_rows(draw_prior(prior, PROPOSED, rng))
    mean, spread = population_law(np.log(rows), design.matrix)
    eta = np.empty((DRAWS, *rows.shape[1:]))
    for j in range(3):
        weight = softmax(evidence(j, mean[..., j], spread[:, j]).sum(axis=1))
        assert 1.0 / (weight**2).sum() > LEAST_EFFECTIVE
        eta[..., j] = rows[rng.choice(PROPOSED, DRAWS, p=weight), :, j]
    return eta.reshape(DRAWS, -1)


def closed_form(measured: case.Measured) -> Evidence:
    """The evidence of a measured log theta."""

    def evidence(j: int, mean: FloatArray, spread: FloatArray) -> FloatArray:
        one = case.Measured(measured.log_theta[:, j : j + 1], measured.error_sd[:, j : j + 1])
        alone = case.Priors((case.THETA_PRIOR.parameters[j],))
        return one.log_evidence(mean[..., None], spread[:, None], alone)

    return evidence


def draw_theta(
    eta: FloatArray, design: Design, measured: case.Measured, rng: np.random.Generator
) -> FloatArray:
    """Draw theta (n, d, 3) of measured persons, of a population of eta (n, k) each."""
    mean, spread = population_law(np.log(in_rows(eta)), design.matrix)
    own, error = 1.0 / spread[:, None] ** 2, 1.0 / measured.error_sd**2
    middle = (mean * own + measured.log_theta * error) / (own + error)
    _, _, low, high = case.law_of(case.THETA_PRIOR)
    return np.exp(case.truncated(middle, 1.0 / np.sqrt(own + error), low, high, rng))
