"""The exact posterior: importance weights, and MCMC where they are not reliable."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.base.progress import LOGGER, Progress
from swesbi.draws import equal_weights
from swesbi.measurement.likelihood import SpeedModelSettings, speed_model
from swesbi.networks.flow.trained import FlowProposal, TrainedFlow, flow_proposal
from swesbi.posterior.adaptive import AdaptedDraws, PriorProposal, adapted, adaptive_rounds
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.importance import (
    LikelihoodModel,
    WeightedDraws,
    evaluate,
    k_hat_limit,
    points_of,
    prior_of_all,
    resample,
)
from swesbi.posterior.laplace import ResidualModel, laplace_proposal
from swesbi.posterior.mcmc import McmcDraws, sample_mcmc, starting_points
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import ExactSettings, McmcSettings, asking
from swesbi.posterior.space import PlacedProposal
from swesbi.prior import JointPriorSettings
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.seeds import generator, integer_seed

PROPOSAL_DRAWS: Final = 2000  # of the network, to be shown and compared: its limits to 5 % of its sd


def exact_posterior(
    model: LikelihoodModel,
    network: PlacedProposal | None,
    settings: ExactSettings,
    seed: int,
    *name: str | int,
    former: AdaptedDraws | None = None,
) -> tuple[ExactPosterior, AdaptedDraws]:
    """Draw from the exact posterior of a recording; ``name`` names the streams of random numbers.

    Rounds of weighted draws begin with the network's, or go on from ``former`` ones. Without a network they
    begin with a normal approximation about the likeliest phi, where the model has residuals, or with the
    prior alone. Where their weights fail the criteria after the last round, MCMC started from them takes
    over. A sampler that does not converge gives its draws all the same, and ``converged`` and ``reasons`` say
    so. Beside the posterior stand the weighted draws.
    NoLikelihoodError: the likelihood is zero at every draw of the first round.
    """
    seeds = [integer_seed(seed, *name, part) for part in ("rounds", "exact", "npe")]
    began = network
    if network is None and former is None and isinstance(model, ResidualModel):
        began = laplace_proposal(model, seeds[0])
    label = " ".join(map(str, ("exact posterior", *name)))
    progress = Progress(label, settings.max_rounds + 1, unit="round", at_most=True)
    for draws in adaptive_rounds(model, settings, seeds[0], began, former):
        progress.step(note=f"efficiency {draws.weighted.efficiency:.1%}")
    exact = checked(model, draws.weighted, settings, seeds[1])
    began_with = _began_with(model, network, min(PROPOSAL_DRAWS, settings.draws), seeds[2])
    return replace(exact, proposal_phi=began_with), draws


def _began_with(model: LikelihoodModel, network: PlacedProposal | None, draws: int, seed: int) -> FloatArray:
    """Return draws phi (draws, d) of the network, or of the prior where there is none."""
    if network is None:
        return PriorProposal(prior_of_all(model)).draw(draws, seed)
    return evaluate(model, network.draw(draws, seed)).phi


def described(
    exact: ExactPosterior, prior: JointPriorSettings, network: FlowProposal | None
) -> ExactPosterior:
    """Return a posterior with the names of its parameters, and what its network was conditioned on."""
    named = replace(exact, parameters=prior.names)
    if network is None:
        return named
    return replace(named, condition=network.condition, components=network.flow.components)


def checked(
    model: LikelihoodModel, weighted: WeightedDraws, settings: ExactSettings, seed: int
) -> ExactPosterior:
    """Return equal draws of the posterior: of the weights where these are reliable, else of MCMC."""
    limit = k_hat_limit(len(weighted.phi), settings.max_k_hat)
    if reasons := weight_failures(weighted, limit, settings.min_effective_draws):
        return _by_mcmc(model, weighted, limit, reasons, settings, seed)
    return ExactPosterior(
        phi=resample(weighted, settings.draws, generator(seed, "exact", "resampling")),
        sampler="importance",
        reasons=(),
        k_hat_limit=limit,
        proposal_phi=np.empty((0, weighted.phi.shape[1])),
        weighted=weighted,
        r_hat=np.full(weighted.phi.shape[1], np.nan),
        effective_draws=np.full(weighted.phi.shape[1], weighted.efficiency * len(weighted.phi)),
        mcmc_steps=0,
        converged=True,
        interval_mass=settings.interval,
        condition=np.empty(0),
    )


def weighted_posterior(
    model: LikelihoodModel,
    network: PlacedProposal,
    effective_draws: int,
    settings: ExactSettings,
    seed: int,
) -> tuple[WeightedDraws, AdaptedDraws]:
    """Return the posterior by as few weighted draws as a check of it needs, and the rounds behind it.

    Rounds of weighted draws go on until their weights are reliable, as in a posterior that is reported, with
    so many effective draws. Where they never are, the draws are not those of the rounds: MCMC started from
    these takes over. None is left out. Draws of MCMC have equal weight, with k-hat, efficiency and evidence
    of the weights that were not reliable.
    """
    wanted = asking(settings, effective_draws)
    rounds = adapted(model, wanted, integer_seed(seed, "rounds"), network)
    weighted, limit = rounds.weighted, k_hat_limit(len(rounds.weighted.phi), wanted.max_k_hat)
    if not weight_failures(weighted, limit, wanted.min_effective_draws):
        return weighted, rounds
    posterior = checked(model, weighted, wanted, seed)
    count = len(posterior.phi)
    drawn = replace(
        weighted,
        phi=posterior.phi,
        from_prior=np.zeros(count, dtype=bool),
        log_likelihood=evaluate(model, points_of(model, posterior.phi)).log_likelihood_of_phi,
        log_weight=np.log(equal_weights(count)),
    )
    return drawn, rounds


def weight_failures(weighted: WeightedDraws, limit: float, min_effective: float) -> tuple[str, ...]:
    """Return why weights are not reliable, a sentence for each criterion that fails."""
    effective = weighted.efficiency * len(weighted.phi)
    reasons = []
    if not weighted.k_hat <= limit:
        reasons.append(f"the Pareto shape of the weights is {weighted.k_hat:.2f}, above {limit:.2f}")
    if not effective >= min_effective:
        draws = len(weighted.phi)
        reasons.append(
            f"{effective:.0f} of {draws} weighted draws are effective, fewer than {min_effective:.0f}"
        )
    return tuple(reasons)


def _by_mcmc(
    model: LikelihoodModel,
    weighted: WeightedDraws,
    limit: float,
    reasons: tuple[str, ...],
    settings: ExactSettings,
    seed: int,
) -> ExactPosterior:
    rng = generator(seed, "exact", "mcmc")
    start = starting_points(model, weighted, settings.mcmc.start_points, rng)
    sampled = sample_mcmc(model, start, settings.mcmc, integer_seed(seed, "exact", "mcmc"))
    number = weighted.phi.shape[1]
    seen = points_of(model, np.arange(number, dtype=np.float64)[None])[0].astype(np.int64)
    # what is integrated out is drawn given the rest, so that it has as many effective draws at least
    r_hat, effective = np.full(number, np.nan), np.full(number, sampled.effective_draws.min())
    r_hat[seen], effective[seen] = sampled.r_hat, sampled.effective_draws
    return ExactPosterior(
        phi=evaluate(model, sampled.thinned(settings.draws, rng)).phi,
        sampler="mcmc",
        reasons=reasons + mcmc_failures(sampled, settings.mcmc),
        k_hat_limit=limit,
        proposal_phi=np.empty((0, weighted.phi.shape[1])),
        weighted=weighted,
        r_hat=r_hat,
        effective_draws=effective,
        mcmc_steps=sampled.steps,
        converged=sampled.converged,
        interval_mass=settings.interval,
        condition=np.empty(0),
    )


def mcmc_failures(sampled: McmcDraws, settings: McmcSettings) -> tuple[str, ...]:
    """Return what a sampler missed, as a sentence; empty where it converged."""
    if sampled.converged:
        return ()
    return (
        f"MCMC has not converged after {sampled.steps} steps: R-hat is {sampled.r_hat.max():.4f} (below "
        f"{settings.max_r_hat:g} is needed) with {sampled.effective_draws.min():.0f} effective draws "
        f"({settings.min_effective_draws} are needed)",
    )


def log_sampling(subject: str, exact: ExactPosterior) -> None:
    """Log what gave the draws, and how reliable they are."""
    LOGGER.info(
        "subject %s: draws by %s; k-hat %.2f, efficiency %.0f %%",
        subject, exact.sampler, exact.k_hat, 100.0 * exact.efficiency,
    )  # fmt: skip
    for reason in exact.reasons:
        LOGGER.log(logging.INFO if exact.converged else logging.WARNING, "  %s", reason)


def posterior_of_subject(
    observation: Observation,
    noise: CohortNoise,
    estimator: TrainedFlow,
    *,
    model: SpeedModelSettings,
    exact: ExactSettings,
    seed: int,
) -> ExactPosterior:
    """Weight the network's draws with the simulator; where the weights fail, sample by MCMC.

    A sampler that does not converge leaves its draws and says so, in the artefact and in the log.

    Raises:
        NoLikelihoodError: Every simulation fails.
    """
    recorded, subject = speed_model(observation, noise, model), observation.subject
    network = flow_proposal(estimator, recorded.recording)
    found, drawn = exact_posterior(HeartModel(recorded), network, exact, seed, "exact", subject)
    rounds = ", ".join(f"{share:.0%}" for share in drawn.efficiency)
    LOGGER.info("efficiency of the network, and of all draws after each further round: %s", rounds)
    log_sampling(subject, found)
    return described(found, model.prior, network)
