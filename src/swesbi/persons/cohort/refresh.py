"""New draws of a subject whose recycled ones leave too few where the population lies.

The subject's posterior is drawn anew under a narrower prior of theta, near what the population says of it.
Old and new draws together are then weighted to the posterior under the first prior: each counts as if it came
from the mixture of all sets (balance heuristic, Veach and Guibas 1995). The sets differ in their priors
alone, so all that is unknown of the mixture is the evidence under each, which the draws themselves give
(Geyer's reverse logistic regression; Shirts and Chodera 2008, J Chem Phys 129:124105, Eq. 11).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.special import logsumexp

from swesbi.base.arrays import FloatArray
from swesbi.measurement.likelihood import SpeedModel
from swesbi.parameters import OF_THETA, THETA_NAMES
from swesbi.persons.cohort.hyperprior import in_rows
from swesbi.persons.cohort.model import CohortModel, RecycledDraws, population_law
from swesbi.persons.cohort.ratio import RatioPrior, log_density
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.fitted import fit_in_nearest, placed_in
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.result import MCMC, ExactPosterior
from swesbi.posterior.settings import ExactSettings
from swesbi.posterior.space import LogitSpace
from swesbi.prior import ParameterPrior, PriorSettings, bounds

ROUNDS: Final = 200
SETTLED: Final = 1e-10
WIDENING: Final = 1.5
"""Of the prior that new draws are made under: draws of a narrower one have no tails."""


@dataclass(frozen=True)
class DrawSet:
    """Equally weighted draws theta (n, 3) of one subject's posterior under one prior."""

    theta: FloatArray
    prior: PriorSettings | RatioPrior


def shrunken_prior(model: CohortModel, eta: FloatArray, subject: int) -> PriorSettings:
    """Return the prior of theta of one subject within the population, averaged over eta (m, k).

    Each parameter is log-Gaussian with mean and variance of the average, a little wider.

    Raises:
        ValueError: The draws are of ratios, which nothing draws anew.
    """
    if isinstance(model.theta_prior, RatioPrior):
        raise ValueError("ratios of two visits are not drawn anew: only theta has a narrower prior")
    mean, spread = population_law(np.log(in_rows(eta)), model.design[subject : subject + 1])
    low, high = bounds(model.theta_prior)
    narrow, wide = np.nextafter(low, high) * 1.0001, np.nextafter(high, low) / 1.0001
    centre = np.clip(np.exp(mean[:, 0].mean(axis=0)), narrow, wide)
    log_sd = WIDENING * np.sqrt((spread**2).mean(axis=0) + mean[:, 0].var(axis=0))
    parameters = {
        name: ParameterPrior(
            centre=float(centre[j]), log_sd=float(log_sd[j]), low=float(low[j]), high=float(high[j])
        )
        for j, name in enumerate(THETA_NAMES)
    }
    return model.theta_prior.model_copy(update=parameters)


def combined(sets: Sequence[DrawSet]) -> RecycledDraws:
    """Return the draws of all sets, weighted to the posterior under the prior of the first.

    A draw's weight is one over the density of the mixture of the sets relative to that posterior,
    sum_s n_s r_s(theta) / c_s, with r_s the ratio of priors and c_s its mean over that posterior.
    """
    theta = np.concatenate([one.theta for one in sets])
    log_first = log_density(theta, sets[0].prior)
    log_ratio = np.stack([log_density(theta, one.prior) - log_first for one in sets])
    log_count = np.log([len(one.theta) for one in sets])
    log_mean = np.zeros(len(sets))
    for _ in range(ROUNDS):
        log_mixture = logsumexp(log_ratio + (log_count - log_mean)[:, None], axis=0)
        found = logsumexp(log_ratio - log_mixture, axis=1)
        found -= found[0]
        settled = np.abs(found - log_mean).max() < SETTLED
        log_mean = found
        if settled:
            break
    log_weight = -logsumexp(log_ratio + (log_count - log_mean)[:, None], axis=0)
    return RecycledDraws(theta, log_weight - logsumexp(log_weight))


def weighted_draws(exact: ExactPosterior) -> tuple[FloatArray, FloatArray]:
    """Return draws phi (n, d) of a posterior and their log weights (n,), which sum to one.

    They are the weighted draws; where the weights failed, the equally weighted ones of MCMC.
    """
    if exact.sampler == MCMC:
        return exact.phi, np.full(len(exact.phi), -np.log(len(exact.phi)))
    return exact.weighted.phi, exact.weighted.log_weight


def redraw_theta(
    model: SpeedModel,
    stored: tuple[FloatArray, FloatArray],
    prior: PriorSettings,
    settings: ExactSettings,
    seed: int,
) -> FloatArray:
    """Draw theta (n, 3) of a subject's exact posterior under another prior of theta.

    The first proposal is fitted to the stored draws, reweighted by the ratio of the priors.

    Args:
        model: The subject's recording, with the prior that the stored draws have.
        stored: phi (n, d) and log weights (n,).
        prior: The other prior of theta.
        settings: Sizes of the exact posterior.
        seed: Seed of everything.

    Raises:
        NoLikelihoodError: The likelihood is zero at every draw.
    """
    phi, log_weight = stored
    theta = phi[:, OF_THETA]
    log_ratio = log_density(theta, prior) - log_density(theta, model.settings.prior.theta)
    joint = model.settings.prior.model_copy(update={"theta": prior})
    narrowed = replace(model, settings=model.settings.model_copy(update={"prior": joint}))
    heart = HeartModel(narrowed)
    placed = placed_in(LogitSpace(joint.simulated), heart.points(phi))
    proposal = fit_in_nearest([placed], log_weight + log_ratio)
    exact, _ = exact_posterior(heart, proposal, settings, seed, "anew")
    return np.asarray(exact.phi[:, OF_THETA])
