"""Posterior draws of one synthetic recording: the network's, and the exact posterior as it is reported."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from swesbi.exact.importance import k_hat_limit, weigh
from swesbi.exact.posterior import exact_posterior, weight_failures
from swesbi.exact.protocols import LikelihoodModel, Proposal
from swesbi.exact.refinement import refine
from swesbi.exact.settings import ExactSettings, RefinementSettings
from swesbi.exact.weights import equal_weights

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Drawn:
    """Weighted draws of a posterior.

    Attributes:
        phi: Draws; shape (n, 4).
        weight: Their weights, which sum to one; shape (n,).
        log_likelihood: Exact log-likelihood of each; shape (n,).
        k_hat: Pareto shape of the importance weights behind them.
        efficiency: Effective share of these weights.
        log_evidence: By these weights.
        by_mcmc: Whether MCMC took over from the weights.
    """

    phi: FloatArray
    weight: FloatArray
    log_likelihood: FloatArray
    k_hat: float
    efficiency: float
    log_evidence: float
    by_mcmc: bool


def exact_draws(
    model: LikelihoodModel,
    proposal: Proposal,
    draws: int,
    settings: ExactSettings,
    seed: int,
    refinement: RefinementSettings | None = None,
) -> Drawn:
    """Return the exact posterior as the study reports it, with fewer weighted draws where these suffice.

    Where so few draws fail the criteria of the weights, the study's own number follows, and MCMC where that
    fails as well. No recording is left out.

    Args:
        model: Prior and exact likelihood.
        proposal: The network's posterior.
        draws: Weighted draws of the first attempt.
        settings: The study's own sizes and criteria.
        seed: Seed of everything.
        refinement: Where the answers of the study refine a proposal that fails, how.
    """
    weighted = weigh(model, proposal, draws, settings.prior_fraction, seed)
    by_mcmc = False
    if weight_failures(weighted, k_hat_limit(draws, settings.max_k_hat), settings.min_efficiency):
        if refinement:
            proposal = refine(model, proposal, refinement, seed).proposal
        posterior = exact_posterior(model, proposal, settings, seed)
        weighted, by_mcmc = posterior.weighted, posterior.sampler == "mcmc"
    drawn = Drawn(
        phi=weighted.phi,
        weight=weighted.weight,
        log_likelihood=weighted.log_likelihood,
        k_hat=weighted.k_hat,
        efficiency=weighted.efficiency,
        log_evidence=weighted.log_evidence,
        by_mcmc=by_mcmc,
    )
    if not by_mcmc:
        return drawn
    log_likelihood = model.log_likelihood(posterior.phi)
    weight = equal_weights(len(posterior.phi))
    return replace(drawn, phi=posterior.phi, weight=weight, log_likelihood=log_likelihood)
