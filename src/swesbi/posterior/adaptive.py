"""Exact posteriors by importance sampling that adapts to the recording and throws no simulation away.

Adaptive multiple importance sampling (Cornuet, Marin, Mira and Robert 2012, Scand J Stat 39:798): draws of
all rounds are weighted by the mixture of all proposals so far, the prior among them, so that no simulation is
lost and no weight exceeds the largest likelihood over the prior's share. It begins with a network's posterior
of the recording, or with the prior alone. Each further proposal is fitted in the base space of the network's
flow or in normal scores of the prior, whichever is nearer; while few draws carry the weight, to a power of
it below one, which leads from the prior to the posterior.

A proposal that is fitted to a draw has a high density there, which lowers the weight of just this draw:
tails come out too light, and neither effective draws nor k-hat show it. So draws come in two halves. Those of
one half are drawn from, and weighted by, proposals fitted to the other half alone (the cross-fitting of
Chernozhukov et al. 2018, Econom J 21:C1).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.special import logsumexp

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.networks.affine_maf import log_normal
from swesbi.posterior.diagnostics import smooth
from swesbi.posterior.fitted import FittedProposal, PlacedDraws, fit_in_nearest, placed_in
from swesbi.posterior.importance import (
    EvaluatedPoints,
    LikelihoodModel,
    NoLikelihoodError,
    Proposal,
    WeightedDraws,
    evaluate,
    evidence,
    k_hat_limit,
)
from swesbi.posterior.settings import ExactSettings, first_counts
from swesbi.posterior.space import PlacedProposal, ScoreSpace, Space
from swesbi.prior import BoxPrior, draw_prior, log_density, to_logit
from swesbi.seeds import generator, integer_seed

SEARCH_DRAWS: Final = 600  # of a proposal on the way, while fewer than ``FOUND_DRAWS`` are effective
FOUND_DRAWS: Final = 60
LEAST_ROUND: Final = 300  # fewer are hardly worth a proposal of their own
# In the logit. Nearer to a face of the box double precision does not tell points apart.
FARTHEST: Final = 30.0


@dataclass(frozen=True)
class PriorProposal:
    """The prior as the first proposal, placed in its normal scores."""

    prior: BoxPrior

    def draw(self, draws: int, seed: int) -> FloatArray:
        """Draw phi; shape (draws, d)."""
        return draw_prior(self.prior, draws, generator(seed, "prior"))

    def log_density(self, phi: FloatArray) -> FloatArray:
        """Return log p(phi), per unit of phi, of phi (n, d); shape (n,)."""
        return log_density(phi, self.prior)

    def log_density_at(self, u: FloatArray, log_slope: FloatArray) -> FloatArray:
        """Return log p(phi) of phi whose scores are u (n, d), as ``place`` gives both; shape (n,)."""
        return log_slope + log_normal(u)

    def place(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return scores u (n, d) of phi (n, d), and log |du / dphi| of shape (n,)."""
        return ScoreSpace(self.prior).place(phi)

    def at(self, u: FloatArray) -> FloatArray:
        """Return phi (n, d) of scores u (n, d)."""
        return ScoreSpace(self.prior).at(u)


@dataclass(frozen=True)
class AdaptedDraws:
    """The n draws so far, their weights and whether these are reliable, and all that a further round needs.

    ``known`` are the draws with their likelihoods, ``placed`` the draws in the spaces of proposals. ``half``
    (n,) is the half of each. ``log_parts`` (n,) are log densities by each of what was drawn from: prior,
    network if there is one, then ``fitted``. ``counts`` is how many were drawn from each. ``efficiency`` is
    that of all draws after each round, the network's own first.
    """

    network: PlacedProposal | None
    weighted: WeightedDraws
    reliable: bool
    known: EvaluatedPoints
    placed: tuple[PlacedDraws, ...]
    half: IntArray
    log_parts: tuple[FloatArray, ...]
    counts: tuple[int, ...]
    fitted: tuple[HalvedProposals, ...]
    efficiency: tuple[float, ...]

    def proposal(self) -> FittedProposal:
        """Return a proposal fitted to all of them, for draws that are yet to come."""
        return fit_in_nearest(self.placed, self.weighted.log_weight)

    def informed(self, settings: ExactSettings) -> AdaptedDraws:
        """Return the same draws weighted by what was known beside the recording as well."""
        known = self.known.informed()
        weighted = weighted_by_all(known, self.log_parts, self.counts)
        reliable, efficiency = is_reliable(weighted, settings), (weighted.efficiency,)
        return replace(self, weighted=weighted, reliable=reliable, known=known, efficiency=efficiency)


@dataclass(frozen=True)
class HalvedProposals:
    """A proposal for each half of the draws, fitted to the other half."""

    of_half: tuple[FittedProposal, FittedProposal]

    def draw(self, each: int, seed: int) -> FloatArray:
        """Draw phi (2 each, d), those of the first half first."""
        return np.concatenate(
            [proposal.draw(each, integer_seed(seed, own)) for own, proposal in enumerate(self.of_half)]
        )

    def log_density(self, placed: Sequence[PlacedDraws], half: IntArray) -> FloatArray:
        """Return the log density of draws of these halves (n,) by the proposal of their half; shape (n,)."""
        log_density = np.empty(len(half))
        for own, proposal in enumerate(self.of_half):
            there = next(draws for draws in placed if draws.space is proposal.space).of(half == own)
            log_density[half == own] = proposal.log_density_at(there.u, there.log_slope)
        return log_density


def fit_halves(placed: Sequence[PlacedDraws], log_weight: FloatArray, half: IntArray) -> HalvedProposals:
    """Fit a proposal for each half (n,) of weighted draws (n,) to the other half."""
    first, second = (
        fit_in_nearest([draws.of(half != own) for draws in placed], log_weight[half != own]) for own in (0, 1)
    )
    return HalvedProposals((first, second))


def adaptive_rounds(
    model: LikelihoodModel,
    settings: ExactSettings,
    seed: int,
    network: PlacedProposal | None = None,
    former: AdaptedDraws | None = None,
) -> Iterator[AdaptedDraws]:
    """Yield the draws after each round, until their weights are reliable or rounds are used up.

    They begin with the network's posterior of the recording, with the prior alone, or with ``former`` draws
    of the same prior. NoLikelihoodError: the likelihood is zero at every draw of the first round.
    """
    now = former or _first_round(model, settings, seed, network)
    for number in range(settings.max_rounds + 1):
        yield now
        if now.reliable or number == settings.max_rounds:
            return
        now = _next_round(now, model, settings, integer_seed(seed, "adaptive", number))


def _first_round(
    model: LikelihoodModel, settings: ExactSettings, seed: int, network: PlacedProposal | None
) -> AdaptedDraws:
    """Draw from the prior and the network."""
    prior = model.settings.prior
    first, counts = _first_proposals(prior, network, settings)
    drawn = [
        part.draw(count, integer_seed(seed, "adaptive", name))
        for part, count, name in zip(first, counts, ("prior", "network"), strict=False)
    ]
    points, half = np.concatenate(drawn), np.concatenate([np.arange(count) % 2 for count in counts])
    known = _evaluated(model, points)
    placed = tuple(placed_in(space, points) for space in _spaces(prior, network))
    log_parts = _log_first(prior, network, points, placed[0])
    weighted = weighted_by_all(known, log_parts, counts)
    return AdaptedDraws(
        network=network,
        weighted=weighted,
        reliable=is_reliable(weighted, settings),
        known=known,
        placed=placed,
        half=half,
        log_parts=tuple(log_parts),
        counts=tuple(counts),
        fitted=(),
        efficiency=(weighted.efficiency,),
    )


def _next_round(
    now: AdaptedDraws, model: LikelihoodModel, settings: ExactSettings, seed: int
) -> AdaptedDraws:
    """Draw from proposals fitted to the draws so far, and weight all by the mixture that they come from."""
    proposals = fit_halves(now.placed, now.weighted.log_weight, now.half)
    each = _round_size(now.weighted, settings)
    more, of_more = proposals.draw(each, seed), np.repeat([0, 1], each)
    more_placed = [placed_in(draws.space, more) for draws in now.placed]
    log_more = _log_first(model.settings.prior, now.network, more, more_placed[0])
    log_more += [former.log_density(more_placed, of_more) for former in now.fitted]
    log_parts = [np.concatenate(pair) for pair in zip(now.log_parts, log_more, strict=True)]
    half = np.concatenate([now.half, of_more])
    placed = tuple(former.with_more(new) for former, new in zip(now.placed, more_placed, strict=True))
    log_parts.append(proposals.log_density(placed, half))
    known, counts = now.known.with_more(_evaluated(model, more)), (*now.counts, 2 * each)
    weighted = weighted_by_all(known, log_parts, counts)
    return replace(
        now,
        weighted=weighted,
        reliable=is_reliable(weighted, settings),
        known=known,
        placed=placed,
        half=half,
        log_parts=tuple(log_parts),
        counts=counts,
        fitted=(*now.fitted, proposals),
        efficiency=(*now.efficiency, weighted.efficiency),
    )


def _spaces(prior: BoxPrior, network: PlacedProposal | None) -> list[Space]:
    """Return in which spaces proposals are fitted: the network's, first, and the prior's normal scores."""
    scores = ScoreSpace(prior)
    fitted_there = isinstance(network, FittedProposal) and network.space == scores
    return [scores] if network is None or fitted_there else [network, scores]


def _log_first(
    prior: BoxPrior, network: PlacedProposal | None, points: FloatArray, placed: PlacedDraws
) -> list[FloatArray]:
    """Return log densities of points (n, k) by what the first round draws from; (n,) each.

    The network's follows from where they lie in the first of the spaces, its own.
    """
    of_prior = log_density(points, prior)
    return [of_prior] if network is None else [of_prior, network.log_density_at(placed.u, placed.log_slope)]


def _evaluated(model: LikelihoodModel, points: FloatArray) -> EvaluatedPoints:
    """Return points (n, k) under the recording; at the faces of the prior's box the likelihood is zero too.

    A posterior has less than e^-30 of its mass there. But a draw from so far out is moved to the nearest
    number, of which neither a flow nor a fitted proposal knows the density that it was drawn with.
    """
    eta, found = to_logit(points, model.settings.prior), evaluate(model, points)
    inside = np.abs(eta).max(axis=1) < FARTHEST
    return replace(found, log_likelihood=np.where(inside, found.log_likelihood, -np.inf))


def _first_proposals(
    prior: BoxPrior, network: PlacedProposal | None, settings: ExactSettings
) -> tuple[list[Proposal], list[int]]:
    """Return what the first round draws from, and how many of each."""
    of_prior, of_network = first_counts(settings)
    if network is None:
        return [PriorProposal(prior)], [of_prior + of_network]
    return [PriorProposal(prior), network], [of_prior, of_network]


def _round_size(weighted: WeightedDraws, settings: ExactSettings) -> int:
    """Return how many draws of each half come next: what is missing, if as effective as those so far."""
    draws, most = len(weighted.phi), settings.round_draws
    effective = weighted.efficiency * draws
    if effective < FOUND_DRAWS:
        return min(SEARCH_DRAWS, most) // 2
    missing = draws * (settings.effective_draws / effective - 1.0)
    # enough of them with a poor Pareto shape: a full round of a better proposal
    wanted = min(max(int(np.ceil(missing)), LEAST_ROUND), most) if missing > 0.0 else most
    return wanted // 2


def adapted(
    model: LikelihoodModel, settings: ExactSettings, seed: int, network: PlacedProposal | None = None
) -> AdaptedDraws:
    """Return the draws after the last round; arguments and errors as of :func:`adaptive_rounds`."""
    *_, last = adaptive_rounds(model, settings, seed, network)
    return last


def weighted_by_all(
    drawn: EvaluatedPoints, log_parts: Sequence[FloatArray], counts: Sequence[int]
) -> WeightedDraws:
    """Weight draws, those of the prior first, by the mixture of all that they come from.

    Log densities (n,) are those of the prior, then of each proposal, or of the one of two that belongs to the
    draw's half. NoLikelihoodError: the likelihood is zero at every draw.
    """
    draws = len(drawn.phi)
    shares = np.array(counts)[:, None] / draws
    log_ratio = log_parts[0] + drawn.log_likelihood - logsumexp(np.stack(log_parts), axis=0, b=shares)
    # a draw whose density a flow cannot give in double precision has no weight, and spoils no other
    log_ratio = np.where(np.isnan(log_ratio), -np.inf, log_ratio)
    if not np.isfinite(log_ratio).any():
        raise NoLikelihoodError(
            f"none of {draws} draws has a likelihood: every simulation failed; check the context"
        )
    log_weight, k_hat = smooth(log_ratio)
    log_evidence, error = evidence(log_ratio)
    return WeightedDraws(
        phi=drawn.phi,
        from_prior=np.arange(draws) < counts[0],
        log_likelihood=drawn.log_likelihood_of_phi,
        log_weight=log_weight,
        k_hat=k_hat,
        efficiency=float(np.exp(-logsumexp(2.0 * log_weight)) / draws),
        log_evidence=log_evidence,
        log_evidence_se=error,
    )


def is_reliable(weighted: WeightedDraws, settings: ExactSettings) -> bool:
    """Tell whether Pareto shape and effective draws are those at which rounds end."""
    draws = len(weighted.phi)
    enough = weighted.efficiency * draws >= settings.effective_draws
    return bool(enough and weighted.k_hat <= k_hat_limit(draws, settings.max_k_hat))
