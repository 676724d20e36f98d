"""The posterior of a population without outliers, drawn without recycling: its parameters are then apart.

Each parameter of theta has its own median, spread and factors, so few hyperparameters at a time are drawn
from the hyperprior and weighted by an evidence that is known.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import hierarchy_case as case
import numpy as np
from scipy.special import softmax

from swesbi.base.arrays import FloatArray
from swesbi.persons.cohort.cohort import Design
from swesbi.persons.cohort.hyperprior import Hyperprior, in_rows
from swesbi.persons.cohort.model import population_law
from swesbi.prior import ParameterPrior, bounds, draw_prior

Evidence = Callable[[int, FloatArray, FloatArray], FloatArray]
"""Log evidence (m, d) of each person's data on a parameter, by its number, mean (m, d) and spread (m,)."""
PROPOSED = 100_000
LEAST_EFFECTIVE = 500


@dataclass(frozen=True)
class OnePrior:
    """The prior of one parameter of theta."""

    parameters: tuple[ParameterPrior]


def draw_eta(
    prior: Hyperprior,
    design: Design,
    evidence: Evidence,
    draws: int,
    rng: np.random.Generator,
    proposed: int = PROPOSED,
) -> FloatArray:
    """Draw hyperparameters (draws, k), each parameter of theta apart."""
    rows = in_rows(draw_prior(prior, proposed, rng))
    mean, spread = population_law(np.log(rows), design.matrix)
    eta = np.empty((draws, *rows.shape[1:]))
    for j in range(3):
        weight = softmax(evidence(j, mean[..., j], spread[:, j]).sum(axis=1))
        assert 1.0 / (weight**2).sum() > LEAST_EFFECTIVE
        eta[..., j] = rows[rng.choice(proposed, draws, p=weight), :, j]
    return eta.reshape(draws, -1)


def closed_form(measured: case.Measured) -> Evidence:
    """The evidence of a measured log theta."""

    def evidence(j: int, mean: FloatArray, spread: FloatArray) -> FloatArray:
        one = case.Measured(measured.log_theta[:, j : j + 1], measured.error_sd[:, j : j + 1])
        return one.log_evidence(mean[..., None], spread[:, None], OnePrior((case.THETA_PRIOR.parameters[j],)))

    return evidence


def draw_theta(
    eta: FloatArray, design: Design, measured: case.Measured, rng: np.random.Generator
) -> FloatArray:
    """Draw theta (n, d, 3) of measured persons, of a population of eta (n, k) each."""
    mean, spread = population_law(np.log(in_rows(eta)), design.matrix)
    own, error = 1.0 / spread[:, None] ** 2, 1.0 / measured.error_sd**2
    middle = (mean * own + measured.log_theta * error) / (own + error)
    low, high = (np.log(limit) for limit in bounds(case.THETA_PRIOR))
    return np.exp(case.truncated(middle, 1.0 / np.sqrt(own + error), low, high, rng))
