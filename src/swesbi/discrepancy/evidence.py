"""What each pair (delta, tau) is worth on one subject: evidence, where the truth lies, misfit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from swesbi.discrepancy.bank import Bank, fill_bank
from swesbi.discrepancy.cohort import GeneratedSubject
from swesbi.discrepancy.settings import DiscrepancyStudySettings
from swesbi.exact.weights import effective_draws, normalised
from swesbi.prior import log_density
from swesbi.speed_model.model import SpeedModelSettings, speed_model

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class PairScore:
    """One subject under one pair.

    Attributes:
        log_evidence: log p(speeds | pair), theta and passive scale integrated out.
        log_evidence_se: Its Monte Carlo standard error.
        truth_level: Posterior probability below the true k_0, k_ATP, k_SR; shape (3,).
        chi2: Squared standardised residuals at the draw of highest posterior density.
        effective_draws: Effective sample size of the importance weights.
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
    """Score every pair of the grid on one subject, from one bank of simulations.

    Args:
        subject: The generated subject.
        settings: The model of its recording; the discrepancy in it is not used.
        study: Grid and effort.
        rng: Source of the draws.
    """
    model = speed_model(subject.recording, settings)
    bank = fill_bank(
        model, study.pairs, study.simulations_per_round, study.max_rounds, study.min_effective_draws, rng
    )
    return score_pairs(bank, subject.theta)


def score_pairs(bank: Bank, theta: FloatArray) -> tuple[PairScore, ...]:
    """Score every pair of a filled bank; the truth is theta (3,)."""
    phi = bank.phi
    density = log_density(phi, bank.prior)
    below = (phi[:, : len(theta)] < theta).astype(np.float64)
    scores: Sequence[PairScore] = []
    for index, log_weight in enumerate(bank.log_weights()):
        weight = normalised(log_weight)
        effective = effective_draws(weight)
        highest = int(np.argmax(density + bank.log_likelihood[index]))
        scores = [
            *scores,
            PairScore(
                log_evidence=float(logsumexp(log_weight) - np.log(len(log_weight))),
                log_evidence_se=float(np.sqrt(max(1.0 / effective - 1.0 / len(log_weight), 0.0))),
                truth_level=weight @ below,
                chi2=float(bank.chi2[index, highest]),
                effective_draws=effective,
            ),
        ]
    return tuple(scores)
