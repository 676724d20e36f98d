"""Exact posteriors by importance sampling that adapts to the recording and throws no simulation away.

Adaptive multiple importance sampling (Cornuet, Marin, Mira and Robert 2012, Scand J Stat 39:798): draws of
all rounds are weighted by the mixture of all proposals so far, the prior among them, so that no simulation is
lost and no weight exceeds the largest likelihood over the prior's share. It begins with a network's posterior
of the recording, or with the prior alone. Each further proposal is fitted to all draws so far, in the base
space of the network's flow or in the logit of the prior's box, whichever is nearer; while few draws carry the
weight, to a power of it below one, which leads from the prior to the posterior.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import logsumexp

from swesbi.arrays import FloatArray
from swesbi.posterior.fitted import fit_in_nearest
from swesbi.posterior.importance import (
    LikelihoodModel,
    NoLikelihoodError,
    WeightedDraws,
    evidence,
    k_hat_limit,
    smooth,
)
from swesbi.posterior.settings import ExactSettings
from swesbi.posterior.space import LogitSpace, PlacedProposal, Space
from swesbi.prior import BoxPrior, draw_prior, log_density
from swesbi.seeds import generator, integer_seed

SEARCH_DRAWS: Final = 300  # of a proposal on the way, while fewer than ``FOUND_DRAWS`` are effective
FOUND_DRAWS: Final = 60
LEAST_ROUND: Final = 300  # fewer are hardly worth a proposal of their own


@dataclass(frozen=True)
class PriorProposal:
    """The prior as the first proposal, placed in the logit of its box."""

    prior: BoxPrior

    def draw(self, draws: int, seed: int) -> FloatArray:
        """Draw phi; shape (draws, d)."""
        return draw_prior(self.prior, draws, generator(seed, "prior"))

    def log_density(self, phi: FloatArray) -> FloatArray:
        """Return log p(phi), per unit of phi, of phi (n, d); shape (n,)."""
        return log_density(phi, self.prior)

    def place(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return eta (n, d) of phi (n, d), and log |deta / dphi| of shape (n,)."""
        return LogitSpace(self.prior).place(phi)

    def at(self, u: FloatArray) -> FloatArray:
        """Return phi (n, d) of eta (n, d)."""
        return LogitSpace(self.prior).at(u)


@dataclass(frozen=True)
class AdaptedDraws:
    """The draws so far, and whether their weights are reliable.

    Attributes:
        weighted: All draws with their weights.
        reliable: Pareto shape and effective draws are those at which rounds end.
        proposal: What the last of them come from.
    """

    weighted: WeightedDraws
    reliable: bool
    proposal: PlacedProposal


def adaptive_rounds(
    model: LikelihoodModel, settings: ExactSettings, seed: int, network: PlacedProposal | None = None
) -> Iterator[AdaptedDraws]:
    """Yield the draws after each round, until their weights are reliable or rounds are used up.

    Args:
        model: Prior and exact likelihood of the recording.
        settings: Give the criteria of reliable weights.
        seed: Seed of everything.
        network: A network's posterior of the recording, with which it begins; None: with the prior alone.

    Raises:
        NoLikelihoodError: The likelihood is zero at every draw of the first round.
    """
    prior = model.settings.prior
    parts: list[PlacedProposal] = [PriorProposal(prior)]
    counts = [settings.first_draws]
    spaces: list[Space] = [LogitSpace(prior)]
    if network is not None:
        of_prior = round(settings.prior_fraction * settings.first_draws)
        counts = [of_prior, settings.first_draws - of_prior]
        parts, spaces = [*parts, network], [network, *spaces]
    names = ("prior", "network")
    phi = np.concatenate(
        [
            part.draw(count, integer_seed(seed, "adaptive", name))
            for part, count, name in zip(parts, counts, names, strict=False)
        ]
    )
    log_parts = [part.log_density(phi) for part in parts]
    log_likelihood = model.log_likelihood(phi)
    for number in range(settings.max_rounds + 1):
        weighted = weighted_by_all(phi, log_likelihood, log_parts, counts)
        reliable = is_reliable(weighted, settings)
        yield AdaptedDraws(weighted, reliable, parts[-1])
        if reliable or number == settings.max_rounds:
            return
        stream = integer_seed(seed, "adaptive", number)
        proposal = fit_in_nearest(spaces, phi, weighted.log_weight, stream)
        drawn = proposal.draw(_round_size(weighted, settings), integer_seed(stream, "draws"))
        # what is known of earlier draws is kept: each part meets the new ones, the new part meets all
        log_parts = [
            np.concatenate([known, part.log_density(drawn)])
            for known, part in zip(log_parts, parts, strict=True)
        ]
        phi = np.concatenate([phi, drawn])
        log_likelihood = np.concatenate([log_likelihood, model.log_likelihood(drawn)])
        parts.append(proposal)
        counts.append(len(drawn))
        log_parts.append(proposal.log_density(phi))


def _round_size(weighted: WeightedDraws, settings: ExactSettings) -> int:
    """Return how many draws come next: as many as are missing, if they are as effective as those so far."""
    draws, most = len(weighted.phi), settings.round_draws
    effective = weighted.efficiency * draws
    if effective < FOUND_DRAWS:
        return min(SEARCH_DRAWS, most)
    missing = draws * (settings.effective_draws / effective - 1.0)
    # enough of them with a poor Pareto shape: a full round of a better proposal
    return min(max(int(np.ceil(missing)), LEAST_ROUND), most) if missing > 0.0 else most


def adapted(
    model: LikelihoodModel, settings: ExactSettings, seed: int, network: PlacedProposal | None = None
) -> AdaptedDraws:
    """Return the draws after the last round; arguments and errors as of :func:`adaptive_rounds`."""
    *_, last = adaptive_rounds(model, settings, seed, network)
    return last


def weighted_by_all(
    phi: FloatArray,
    log_likelihood: FloatArray,
    log_parts: Sequence[FloatArray],
    counts: Sequence[int],
) -> WeightedDraws:
    """Weight draws by the mixture of all that they come from.

    Args:
        phi: Draws, those of the prior first; shape (n, d).
        log_likelihood: Of each; shape (n,).
        log_parts: Log densities of the prior, then of each proposal, at every draw; (n,) each.
        counts: Draws of the prior, and of each proposal.

    Raises:
        NoLikelihoodError: The likelihood is zero at every draw.
    """
    shares = np.array(counts)[:, None] / len(phi)
    log_ratio = log_parts[0] + log_likelihood - logsumexp(np.stack(log_parts), axis=0, b=shares)
    if not np.isfinite(log_ratio).any():
        raise NoLikelihoodError(
            f"none of {len(phi)} draws has a likelihood: every simulation failed; check the context"
        )
    log_weight, k_hat = smooth(log_ratio)
    log_evidence, error = evidence(log_ratio)
    return WeightedDraws(
        phi=phi,
        from_prior=np.arange(len(phi)) < counts[0],
        log_likelihood=log_likelihood,
        log_weight=log_weight,
        k_hat=k_hat,
        efficiency=float(np.exp(-logsumexp(2.0 * log_weight)) / len(phi)),
        log_evidence=log_evidence,
        log_evidence_se=error,
    )


def is_reliable(weighted: WeightedDraws, settings: ExactSettings) -> bool:
    """Tell whether Pareto shape and effective draws are those at which rounds end."""
    draws = len(weighted.phi)
    enough = weighted.efficiency * draws >= settings.effective_draws
    return bool(enough and weighted.k_hat <= k_hat_limit(draws, settings.max_k_hat))
