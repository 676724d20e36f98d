"""A bank of simulations of one recording, shared by every pair (delta, tau), from adapted proposals.

Adaptive multiple importance sampling (Cornuet, Marin, Mira and Robert 2012, Scand J Stat 39:798): draws of
all proposals are weighted by their mixture. The first proposal is the prior; each further one is fitted to
the posterior that the bank covers worst, made wider, until every posterior of the grid is covered.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from swesbi.draws import effective_draws, normalised
from swesbi.measurement.likelihood import SpeedModel, log_speed_sd
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.parameters import PHI_NAMES
from swesbi.posterior.refine import fitted_proposal
from swesbi.prior import JointPriorSettings, from_logit, log_density, log_jacobian, sample, to_logit

FloatArray = NDArray[np.float64]


class LogitProposal(Protocol):
    """A density of eta, the logit of phi in its box, that can be drawn from."""

    def draw(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return eta of shape (count, 4)."""

    def log_density(self, eta: FloatArray) -> FloatArray:
        """Return the log density at eta (n, 4); shape (n,)."""


@dataclass(frozen=True)
class PriorProposal:
    """The joint prior itself."""

    prior: JointPriorSettings

    def draw(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return eta of shape (count, 4)."""
        return to_logit(sample(count, self.prior, rng), self.prior)

    def log_density(self, eta: FloatArray) -> FloatArray:
        """Return log p(eta) = log p(phi) + log |d phi / d eta|; shape (n,)."""
        return log_density(from_logit(eta, self.prior), self.prior) + log_jacobian(eta, self.prior)


@dataclass
class Bank:
    """Simulations of one recording with their likelihood under each of K pairs; grows by :meth:`extend`.

    Attributes:
        model: The recording's model; its own discrepancy is not used.
        pairs: The K pairs (delta, tau).
        eta: Draws; shape (n, 4).
        log_likelihood: log p(speeds | eta, pair); shape (K, n).
        chi2: Sum of squared standardised residuals over the measured phases; shape (K, n).
    """

    model: SpeedModel
    pairs: Sequence[DiscrepancySettings]
    eta: FloatArray = field(init=False)
    log_likelihood: FloatArray = field(init=False)
    chi2: FloatArray = field(init=False)
    _proposals: list[LogitProposal] = field(default_factory=list)
    _counts: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.eta = np.empty((0, len(PHI_NAMES)))
        self.log_likelihood = np.empty((len(self.pairs), 0))
        self.chi2 = np.empty((len(self.pairs), 0))

    @property
    def prior(self) -> JointPriorSettings:
        """The joint prior of phi."""
        return self.model.settings.prior

    @property
    def phi(self) -> FloatArray:
        """The draws as parameters; shape (n, 4)."""
        return from_logit(self.eta, self.prior)

    def extend(self, proposal: LogitProposal, count: int, rng: np.random.Generator) -> None:
        """Add ``count`` draws of a proposal and their simulations."""
        eta = proposal.draw(count, rng)
        log_likelihood, chi2 = _likelihoods(self.model, from_logit(eta, self.prior), self.pairs)
        self.eta = np.concatenate([self.eta, eta])
        self.log_likelihood = np.concatenate([self.log_likelihood, log_likelihood], axis=1)
        self.chi2 = np.concatenate([self.chi2, chi2], axis=1)
        self._proposals.append(proposal)
        self._counts.append(count)

    def log_weights(self) -> FloatArray:
        """Return log of p(eta) p(speeds | eta, pair) / mixture of the proposals; shape (K, n)."""
        shares = np.log(np.array(self._counts) / len(self.eta))
        mixture = logsumexp(
            [q.log_density(self.eta) + share for q, share in zip(self._proposals, shares, strict=True)],
            axis=0,
        )
        prior = PriorProposal(self.prior).log_density(self.eta)
        return np.asarray(prior + self.log_likelihood - mixture)


def fill_bank(
    model: SpeedModel,
    pairs: Sequence[DiscrepancySettings],
    per_round: int,
    max_rounds: int,
    min_effective_draws: float,
    rng: np.random.Generator,
) -> Bank:
    """Simulate until every pair has enough effective draws, or the rounds are used up.

    Args:
        model: The recording's model.
        pairs: The grid of (delta, tau).
        per_round: Simulations of each proposal.
        max_rounds: Proposals at most.
        min_effective_draws: Effective sample size at which a pair is done.
        rng: Source of the draws.
    """
    bank = Bank(model, pairs)
    bank.extend(PriorProposal(bank.prior), per_round, rng)
    for _ in range(max_rounds - 1):
        log_weights = bank.log_weights()
        effective = np.array([effective_draws(normalised(row)) for row in log_weights])
        worst = int(effective.argmin())
        if effective[worst] >= min_effective_draws:
            break
        bank.extend(fitted_proposal(bank.eta, log_weights[worst]), per_round, rng)
    return bank


def _likelihoods(
    model: SpeedModel, phi: FloatArray, pairs: Sequence[DiscrepancySettings]
) -> tuple[FloatArray, FloatArray]:
    """Return log likelihood and chi-squared of phi (n, 4) under each pair, (K, n).

    They are -inf and inf where the simulation failed.
    """
    recording, predicted = model.recording, model.predict(phi)
    distance = np.log(recording.speed_m_s) - predicted.log_speed
    log_likelihood, chi2 = np.empty((2, len(pairs), len(phi)))
    for index, pair in enumerate(pairs):
        sd = log_speed_sd(predicted, recording.relative_se, pair)
        chi2[index] = ((distance / sd) ** 2).sum(axis=1)
        log_likelihood[index] = -0.5 * chi2[index] - np.log(sd * np.sqrt(2.0 * np.pi)).sum(axis=1)
    failed = np.isnan(log_likelihood)
    return np.where(failed, -np.inf, log_likelihood), np.where(failed, np.inf, chi2)
