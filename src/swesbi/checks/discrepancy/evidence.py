"""What each pair (delta, tau) is worth on a generated cohort: evidence, coverage of the truth, misfit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import logsumexp

from swesbi.checks.discrepancy.bank import Bank, fill_bank
from swesbi.checks.discrepancy.cohort import GeneratedSubject
from swesbi.checks.settings import DiscrepancyStudySettings
from swesbi.draws import effective_draws, normalised
from swesbi.measurement.likelihood import SpeedModelSettings, speed_model
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.parameters import THETA_NAMES
from swesbi.prior import log_density

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


def discrepancy_table(
    pairs: Sequence[DiscrepancySettings],
    scores: Sequence[Sequence[PairScore]],
    phases: Sequence[int],
    interval: float,
) -> pd.DataFrame:
    """Return one row a pair.

    Columns: speed_fraction, timing_cycle, log_evidence (total) and its Monte Carlo standard error,
    below_best (total log evidence of the best pair less that of the row) and its standard error over
    subjects, coverage of each true parameter, mean chi2, its expectation phases (mean number of measured
    phases, less whatever the parameters fit), least effective draws of any subject, subjects, best (1 or 0).

    Args:
        pairs: K pairs.
        scores: Of each subject, the scores of the K pairs.
        phases: Measured phases of each subject.
        interval: Mass of the intervals whose coverage is counted.
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


def best_pair(table: pd.DataFrame) -> DiscrepancySettings:
    """Return the pair with the highest total log evidence."""
    row = table.iloc[int(table["log_evidence"].argmax())]
    return DiscrepancySettings(
        speed_fraction=float(row["speed_fraction"]), timing_cycle=float(row["timing_cycle"])
    )


def _standard_error_of_sum(differences: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    if len(differences) < 2:
        return float("nan")
    return float(np.sqrt(len(differences)) * differences.std(ddof=1))
