"""A proposal that fits a recording badly, refined by the recording's own likelihood before it is weighted.

Adaptive multiple importance sampling (Cornuet, Marin, Mira and Robert 2012, Scand J Stat 39:798): draws are
weighted, a mixture of Student distributions is fitted to those of all rounds, and takes most of the network's
place in the next one. It is fitted in the flow's base space, where a posterior that the flow nearly knows is
nearly normal (the map of Parno and Marzouk 2018, SIAM/ASA J Uncertain Quantif 6:645, here learnt beforehand).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from swesbi.draws import normalised
from swesbi.posterior.exact import ExactPosterior, exact_posterior
from swesbi.posterior.importance import LikelihoodModel, Proposal, WeightedDraws, weigh
from swesbi.posterior.mode import mode_proposal
from swesbi.posterior.settings import ExactSettings, RefinementSettings
from swesbi.posterior.space import LogitSpace, Space
from swesbi.posterior.student import StudentMixture, StudentProposal, fitted_mixture
from swesbi.prior import BoxPrior, log_density
from swesbi.seeds import integer_seed

FloatArray = NDArray[np.float64]
KEPT_SHARE: Final = 0.2  # of the first proposal beside a fitted one
LOST_EFFICIENCY: Final = 0.005  # of a network: ten effective draws of the first two thousand
LEAST_GAIN: Final = 1.1  # of a round, over the best before it, that lets another follow


@dataclass(frozen=True)
class FittedProposal:
    """A Student distribution, or a mixture of them, in a space, as a density over phi."""

    student: StudentProposal | StudentMixture
    space: Space

    def draw(self, draws: int, seed: int) -> FloatArray:
        """Draw phi (draws, d)."""
        return self.space.at(self.student.draw(draws, np.random.default_rng(seed)))

    def log_density(self, phi: FloatArray) -> FloatArray:
        """Return log q(phi) = log q(u) + log |du / dphi| of phi (n, d); shape (n,)."""
        u, log_slope = self.space.place(phi)
        # far from all that a flow was trained on its map overflows; nothing is drawn there
        known = np.isfinite(u).all(axis=1) & np.isfinite(log_slope)
        log_density = np.full(len(phi), -np.inf)
        log_density[known] = self.student.log_density(u[known]) + log_slope[known]
        return log_density


@dataclass(frozen=True)
class PairProposal:
    """A first proposal with the share ``KEPT_SHARE``, and a fitted one with the rest."""

    first: Proposal
    fitted: Proposal

    def draw(self, draws: int, seed: int) -> FloatArray:
        """Draw phi (draws, d): as many from each as its share says."""
        kept = round(KEPT_SHARE * draws)
        seeds = [integer_seed(seed, "refinement", name) for name in ("first", "fitted")]
        return np.concatenate([self.first.draw(kept, seeds[0]), self.fitted.draw(draws - kept, seeds[1])])

    def log_density(self, phi: FloatArray) -> FloatArray:
        """Return the log density of the mixture at phi (n, d); shape (n,)."""
        parts = [self.first.log_density(phi), self.fitted.log_density(phi)]
        shares = np.array([[KEPT_SHARE], [1.0 - KEPT_SHARE]])
        return np.asarray(logsumexp(np.stack(parts), axis=0, b=shares))


@dataclass(frozen=True)
class Refined:
    """The best proposal that was found, good enough to be weighted or not.

    Attributes:
        proposal: The proposal.
        efficiency: Efficiency of the first proposal, and of each that was fitted after it.
    """

    proposal: Proposal
    efficiency: tuple[float, ...]


def refine(model: LikelihoodModel, first: Proposal, settings: RefinementSettings, seed: int) -> Refined:
    """Return ``first`` where its weights are efficient, or else the best mixture of it and a fitted proposal.

    What is fitted lives in the base space of a flow: what the flow knows of the posterior's shape is kept,
    and its errors of place and width are what is left. Of a recording that it does not know at all, the logit
    of the prior's box may be the better space. Draws of all rounds are fitted; the less efficient a proposal,
    the more are drawn. Where hardly any draw of ``first`` counts, it is left aside, and all begins about the
    posterior's mode.

    Args:
        model: Prior and exact likelihood of the recording.
        first: The proposal to begin with.
        settings: When to stop.
        seed: Seed of everything.

    Raises:
        NoLikelihoodError: The likelihood is zero at every draw of a round.
    """
    rounds: list[_Round] = []
    proposal: Proposal = first
    for number in range(settings.max_rounds + 1):
        stream = integer_seed(seed, "refinement", number)
        draws = _draws_of(rounds, settings)
        weighted = weigh(model, proposal, draws, settings.prior_fraction, stream)
        rounds.append(_Round(proposal, weighted))
        if number == settings.max_rounds or _is_enough(rounds, settings):
            break
        if rounds[0].weighted.efficiency >= LOST_EFFICIENCY:
            proposal = PairProposal(first, _fitted(rounds, _spaces(first, model.settings.prior), stream))
        elif number == 0:
            proposal = _about_mode(model, weighted, stream)
        else:
            proposal = _fitted(rounds[1:], [LogitSpace(model.settings.prior)], stream)
    best = max(rounds, key=lambda one: one.weighted.efficiency)
    return Refined(best.proposal, tuple(one.weighted.efficiency for one in rounds))


@dataclass(frozen=True)
class _Round:
    proposal: Proposal
    weighted: WeightedDraws


def _draws_of(rounds: Sequence[_Round], settings: RefinementSettings) -> int:
    """Return as many draws for the next round as give enough effective ones at the efficiency of the last."""
    if not rounds:
        return settings.draws
    wanted = settings.effective_draws / rounds[-1].weighted.efficiency
    return int(np.clip(wanted, settings.draws, settings.most_draws))


def _is_enough(rounds: Sequence[_Round], settings: RefinementSettings) -> bool:
    """Tell whether the last proposal is efficient, or usable and hardly better than the best before it."""
    *before, last = (one.weighted.efficiency for one in rounds)
    if last >= settings.min_efficiency:
        return True
    best = max(before, default=0.0)
    return max(last, best) >= settings.usable_efficiency and last < LEAST_GAIN * best


def _spaces(first: Proposal, prior: BoxPrior) -> list[Space]:
    return [first, LogitSpace(prior)] if isinstance(first, Space) else [LogitSpace(prior)]


def _about_mode(model: LikelihoodModel, weighted: WeightedDraws, seed: int) -> FittedProposal:
    """Return a proposal about the mode of the posterior, which is sought from the likeliest draw."""
    space = LogitSpace(model.settings.prior)
    eta, log_slope = space.place(weighted.phi)
    likeliest = int(np.argmax(log_density(weighted.phi, space.prior) + weighted.log_likelihood - log_slope))
    return FittedProposal(mode_proposal(model, eta[likeliest], seed), space)


def _fitted(rounds: Sequence[_Round], spaces: Sequence[Space], seed: int) -> FittedProposal:
    """Fit a proposal to the weighted draws of all rounds, which count by their effective draws."""
    phi = np.concatenate([one.weighted.phi for one in rounds])
    log_shares = np.log([one.weighted.efficiency * len(one.weighted.phi) for one in rounds])
    log_weight = [one.weighted.log_weight + share for one, share in zip(rounds, log_shares, strict=True)]
    return fit_in_nearest(spaces, phi, np.concatenate(log_weight), seed)


def fit_in_nearest(
    spaces: Sequence[Space], phi: FloatArray, log_weight: FloatArray, seed: int
) -> FittedProposal:
    """Fit a proposal to weighted draws phi (n, d) in each space, and return the one nearest to them.

    Nearest is the largest mean log density, which is the least divergence of the posterior from the proposal,
    up to a constant.
    """
    fits = [_fitted_in(space, phi, log_weight, seed) for space in spaces]
    best = max(range(len(fits)), key=lambda number: fits[number][1])
    return fits[best][0]


def _fitted_in(
    space: Space, phi: FloatArray, log_weight: FloatArray, seed: int
) -> tuple[FittedProposal, float]:
    """Return what is fitted in a space, and its mean log density over the weighted draws phi (n, d).

    That is -inf where the draws lie so far apart in it that their covariance is singular in double precision.
    """
    u, log_slope = space.place(phi)
    known = np.isfinite(u).all(axis=1) & np.isfinite(log_slope)
    mixture = fitted_mixture(u[known], log_weight[known], seed)
    try:
        log_q = mixture.log_density(u[known]) + log_slope[known]
    except np.linalg.LinAlgError:
        return FittedProposal(mixture, space), -np.inf
    return FittedProposal(mixture, space), float(normalised(log_weight[known]) @ log_q)


def refined_posterior(
    model: LikelihoodModel,
    network: Proposal,
    settings: ExactSettings,
    seed: int,
    *name: str | int,
) -> tuple[ExactPosterior, tuple[float, ...]]:
    """Draw from the exact posterior of a recording that the network may not know well.

    Returns:
        The posterior, with the network's own draws beside it, and the efficiency of the network and of
        each proposal that was fitted after it.

    Raises:
        NoLikelihoodError: The likelihood is zero at every draw of a round.
    """
    seeds = [integer_seed(seed, *name, part) for part in ("refined", "exact", "npe")]
    refined = refine(model, network, settings.refinement, seeds[0])
    exact = exact_posterior(model, refined.proposal, settings, seeds[1])
    return replace(exact, npe_phi=network.draw(settings.draws, seeds[2])), refined.efficiency
