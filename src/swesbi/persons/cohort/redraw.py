"""One subject's posterior drawn anew under a narrower prior of theta, by its own exact likelihood."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.measurement.likelihood import SpeedModel
from swesbi.parameters import OF_THETA
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.fitted import fit_in_nearest, placed_in
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.result import MCMC, ExactPosterior
from swesbi.posterior.settings import ExactSettings
from swesbi.posterior.space import LogitSpace
from swesbi.prior import PriorSettings, log_density


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
