"""What each pair (delta, tau) is worth on a generated cohort: evidence, coverage of the truth, misfit.

Adaptive multiple importance sampling (Cornuet, Marin, Mira and Robert 2012, Scand J Stat 39:798): draws of
all proposals are weighted by their mixture. The first proposal is the prior; each further one is fitted to
the posterior that the bank covers worst, made wider, until every posterior of the grid is covered. Draws come
in two halves, and proposals of one half are fitted to the other, as in :mod:`swesbi.posterior.adaptive`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import logsumexp

from studies.discrepancy.settings import DiscrepancyStudySettings
from swesbi.base.arrays import IntArray
from swesbi.draws import effective_draws, normalised
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, standardise
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.parameters import THETA_NAMES
from swesbi.posterior.fitted import StudentMixture, fitted_proposal
from swesbi.prior import JointPriorSettings, from_logit, log_density, log_jacobian, sample, to_logit
from swesbi.virtual.generated import GeneratedSubject

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class PriorProposal:
    """The joint prior itself."""

    prior: JointPriorSettings

    def draw(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return eta of shape (count, d)."""
        return to_logit(sample(count, self.prior, rng), self.prior)

    def log_density(self, eta: FloatArray) -> FloatArray:
        """Return log p(eta) = log p(phi) + log |d phi / d eta|; shape (n,)."""
        return log_density(from_logit(eta, self.prior), self.prior) + log_jacobian(eta, self.prior)


LogitProposal = PriorProposal | StudentMixture
"""A density of eta, the logit of phi in its box, that can be drawn from."""


@dataclass
class Bank:
    """Simulations of one recording with their likelihood under each of K pairs; grows by :meth:`extend`.

    The discrepancy of the model itself is not used. Draws ``eta`` are (n, d) and belong to half 0 or 1;
    ``log_likelihood`` and ``chi2``, over the measured phases, are (K, n).
    """

    model: SpeedModel
    pairs: Sequence[DiscrepancySettings]
    eta: FloatArray = field(init=False)
    half: IntArray = field(init=False)
    log_likelihood: FloatArray = field(init=False)
    chi2: FloatArray = field(init=False)
    _proposals: list[tuple[LogitProposal, LogitProposal]] = field(default_factory=list)
    _counts: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.eta = np.empty((0, len(self.prior.names)))
        self.half = np.empty(0, dtype=np.intp)
        self.log_likelihood = np.empty((len(self.pairs), 0))
        self.chi2 = np.empty((len(self.pairs), 0))

    @property
    def prior(self) -> JointPriorSettings:
        """The joint prior of phi."""
        return self.model.settings.prior

    @property
    def phi(self) -> FloatArray:
        """The draws as parameters; shape (n, d)."""
        return from_logit(self.eta, self.prior)

    @property
    def rounds(self) -> int:
        """Number of proposals so far."""
        return len(self._proposals)

    def extend(self, proposal: LogitProposal, count: int, rng: np.random.Generator) -> None:
        """Add ``count`` draws of a proposal that knows nothing of the bank, and their simulations."""
        self._extend((proposal, proposal), count, rng)

    def extend_towards(self, pair: int, count: int, rng: np.random.Generator) -> None:
        """Add ``count`` draws near the posterior of a pair: of each half, where the other half finds it."""
        log_weight = self.log_weights()[pair]
        first, second = (
            fitted_proposal(self.eta[self.half != own], log_weight[self.half != own]) for own in (0, 1)
        )
        self._extend((first, second), count, rng)

    def _extend(
        self, of_half: tuple[LogitProposal, LogitProposal], count: int, rng: np.random.Generator
    ) -> None:
        counts = (count - count // 2, count // 2)
        eta = np.concatenate([part.draw(size, rng) for part, size in zip(of_half, counts, strict=True)])
        log_likelihood, chi2 = _likelihoods(self.model, from_logit(eta, self.prior), self.pairs)
        self.eta = np.concatenate([self.eta, eta])
        self.half = np.concatenate([self.half, np.repeat([0, 1], counts)])
        self.log_likelihood = np.concatenate([self.log_likelihood, log_likelihood], axis=1)
        self.chi2 = np.concatenate([self.chi2, chi2], axis=1)
        self._proposals.append(of_half)
        self._counts.append(count)

    def log_weights(self) -> FloatArray:
        """Return log of p(eta) p(speeds | eta, pair) / mixture of the proposals; shape (K, n)."""
        shares = np.log(np.array(self._counts) / len(self.eta))
        parts = [
            np.where(self.half == 0, first.log_density(self.eta), second.log_density(self.eta)) + share
            for (first, second), share in zip(self._proposals, shares, strict=True)
        ]
        mixture = logsumexp(parts, axis=0)
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

    Each of at most ``max_rounds`` proposals is simulated ``per_round`` times.
    """
    bank = Bank(model, pairs)
    bank.extend(PriorProposal(bank.prior), per_round, rng)
    while bank.rounds < max_rounds:
        log_weights = bank.log_weights()
        effective = np.array([effective_draws(normalised(row)) for row in log_weights])
        worst = int(effective.argmin())
        if effective[worst] >= min_effective_draws:
            break
        bank.extend_towards(worst, per_round, rng)
    return bank


def _likelihoods(
    model: SpeedModel, phi: FloatArray, pairs: Sequence[DiscrepancySettings]
) -> tuple[FloatArray, FloatArray]:
    """Return log likelihood and chi-squared of phi (n, d) under each pair, (K, n).

    They are -inf and inf where the simulation failed.
    """
    predicted = model.predict(phi)
    log_likelihood, chi2 = np.empty((2, len(pairs), len(phi)))
    for index, pair in enumerate(pairs):
        found = standardise(predicted, model.recording, pair)
        log_likelihood[index], chi2[index] = found.log_density, found.chi_squared
    failed = np.isnan(log_likelihood)
    return np.where(failed, -np.inf, log_likelihood), np.where(failed, np.inf, chi2)


@dataclass(frozen=True)
class PairScore:
    """One subject under one pair; theta and passive scale are integrated out of the evidence.

    ``truth_level`` (3,) is the posterior probability below the true k_0, k_ATP, k_SR. ``chi2`` is taken at
    the draw of highest posterior density.
    """

    log_evidence: float
    log_evidence_se: float
    truth_level: FloatArray
    chi2: float
    effective_draws: float

    def covered(self, interval: float) -> NDArray[np.bool_]:
        """Tell whether the central credible interval of this mass holds each true parameter; shape (3,)."""
        return np.asarray(np.abs(self.truth_level - 0.5) <= 0.5 * interval)


def score_subject(
    subject: GeneratedSubject,
    settings: SpeedModelSettings,
    study: DiscrepancyStudySettings,
    rng: np.random.Generator,
) -> tuple[PairScore, ...]:
    """Score every pair of the grid on one subject, from one bank; the settings' discrepancy is not used."""
    model = SpeedModel(subject.recording, settings)
    bank = fill_bank(
        model, study.pairs, study.simulations_per_round, study.max_rounds, study.min_effective_draws, rng
    )
    return score_pairs(bank, subject.theta)


def score_pairs(bank: Bank, theta: FloatArray) -> tuple[PairScore, ...]:
    """Score every pair of a filled bank; the truth is theta (3,)."""
    phi = bank.phi
    density = log_density(phi, bank.prior)
    below = (phi[:, : len(theta)] < theta).astype(np.float64)
    scores = []
    for index, log_weight in enumerate(bank.log_weights()):
        weight = normalised(log_weight)
        effective = effective_draws(weight)
        highest = int(np.argmax(density + bank.log_likelihood[index]))
        score = PairScore(
            log_evidence=float(logsumexp(log_weight) - np.log(len(log_weight))),
            log_evidence_se=evidence_se(effective, len(log_weight)),
            truth_level=weight @ below,
            chi2=float(bank.chi2[index, highest]),
            effective_draws=effective,
        )
        scores.append(score)
    return tuple(scores)


def evidence_se(effective: float, draws: int) -> float:
    """Return the standard error of a log evidence from so many weighted draws (delta method)."""
    return float(np.sqrt(max(1.0 / effective - 1.0 / draws, 0.0)))


def discrepancy_table(
    pairs: Sequence[DiscrepancySettings],
    scores: Sequence[Sequence[PairScore]],
    phases: Sequence[int],
    interval: float,
) -> pd.DataFrame:
    """Return one row a pair; coverage is that of intervals of the given mass.

    ``below_best`` is the total log evidence of the best pair less that of the row, with its standard error
    over subjects. ``phases``, the mean number of measured phases, is the expectation of the mean chi2, less
    whatever the parameters fit. Effective draws are the least of any subject.
    """
    evidence = np.array([[score.log_evidence for score in row] for row in scores])
    best = int(evidence.sum(axis=0).argmax())
    below = evidence[:, [best]] - evidence
    rows = []
    for index, pair in enumerate(pairs):
        of_pair = [row[index] for row in scores]
        covered = np.mean([score.covered(interval) for score in of_pair], axis=0)
        rows.append(
            {
                "speed_fraction": pair.speed_fraction,
                "timing_cycle": pair.timing_cycle,
                "log_evidence": evidence[:, index].sum(),
                "log_evidence_se": float(np.sqrt(sum(score.log_evidence_se**2 for score in of_pair))),
                "below_best": below[:, index].sum(),
                "below_best_se": _standard_error_of_sum(below[:, index]),
            }
            | {f"coverage_{name}": share for name, share in zip(THETA_NAMES, covered, strict=True)}
            | {
                "mean_chi2": float(np.mean([score.chi2 for score in of_pair])),
                "mean_phases": float(np.mean(phases)),
                "min_effective_draws": min(score.effective_draws for score in of_pair),
                "subjects": len(of_pair),
                "best": int(index == best),
            }
        )
    return pd.DataFrame(rows)


def _standard_error_of_sum(differences: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    if len(differences) < 2:
        return float("nan")
    return float(np.sqrt(len(differences)) * differences.std(ddof=1))
