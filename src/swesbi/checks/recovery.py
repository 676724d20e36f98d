"""Recovery of known parameters: coverage, bias and contraction over synthetic recordings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.checks.calibration.settings import JudgementSettings
from swesbi.checks.settings import RecoverySettings
from swesbi.context import Context
from swesbi.draws import interval_levels
from swesbi.heart.prior_simulations import PriorSimulations, draw_simulations
from swesbi.heart.settings import ForwardModelSettings
from swesbi.parameters import THETA_NAMES
from swesbi.prior import PriorSettings, in_bounds, prior_variance
from swesbi.seeds import integer_seed

CoverageSettings = RecoverySettings | JudgementSettings
"""Which say what intervals are scored."""


class NothingRecoveredError(ValueError):
    """No synthetic recording has enough draws within the prior's bounds; the message says what to do."""


@dataclass(frozen=True)
class RecoveryRow:
    """One parameter at one nominal level; the fields are the columns of ``recovery.csv``.

    Attributes:
        parameter: Name of the parameter, its unit included.
        nominal: Mass of the equal-tailed credible interval.
        coverage: Share of the recordings whose interval holds the true value.
        ci_low: Lower end of the Clopper-Pearson interval on the coverage.
        ci_high: Its upper end.
        n: Recordings scored.
        bias: Mean of posterior mean minus truth, in the parameter's unit.
        contraction: 1 - mean posterior variance / prior variance.
    """

    parameter: str
    nominal: float
    coverage: float
    ci_low: float
    ci_high: float
    n: int
    bias: float
    contraction: float


@dataclass(frozen=True)
class ScoredPosteriors:
    """Posteriors of n scored recordings: truth, mean and variance (n, 3), and ``level_of_truth`` (n, 3).

    ``level_of_truth`` is the share of the in-prior draws below the truth, ties counted by half.
    """

    truth: FloatArray
    mean: FloatArray
    variance: FloatArray
    level_of_truth: FloatArray


def fresh_simulations(
    count: int, context: Context, prior: PriorSettings, forward_model: ForwardModelSettings, seed: int
) -> PriorSimulations:
    """Simulate theta that no training has seen: the prior's draws under another root of the streams.

    Every kind of recovery uses the same theta, so their scores can be compared.
    """
    return draw_simulations(range(count), context, prior, forward_model, integer_seed(seed, "recovery"))


def recover(
    truth: FloatArray, candidates: FloatArray, prior: PriorSettings, settings: RecoverySettings
) -> ScoredPosteriors:
    """Reduce the draws of each recording's posterior to what the scores need.

    A recording with fewer than ``min_in_prior_draws`` candidates in the prior's bounds has no posterior
    that the study would report: it is left out, and the number of recordings scored says so.

    Args:
        truth: (N, 3) parameters that the recordings were simulated with.
        candidates: (N, S, 3) unfiltered draws from the estimator for each.
        prior: The prior whose bounds filter the draws.
        settings: The least number of draws.

    Raises:
        NothingRecoveredError: No recording is left.
    """
    inside = [draws[in_bounds(draws, prior)] for draws in candidates]
    scored = [i for i, draws in enumerate(inside) if len(draws) >= settings.min_in_prior_draws]
    if not scored:
        raise NothingRecoveredError(
            f"none of the {len(truth)} synthetic recordings has {settings.min_in_prior_draws} draws in the "
            "prior's bounds: the estimator has not learned the posterior; train it longer"
        )
    kept, known = [inside[i] for i in scored], truth[scored]
    below = [(d < t).mean(axis=0) + 0.5 * (d == t).mean(axis=0) for d, t in zip(kept, known, strict=True)]
    return ScoredPosteriors(
        truth=known,
        mean=np.stack([draws.mean(axis=0) for draws in kept]),
        variance=np.stack([draws.var(axis=0, ddof=1) for draws in kept]),
        level_of_truth=np.stack(below),
    )


def score_recovery(
    recovered: ScoredPosteriors, prior: PriorSettings, settings: CoverageSettings
) -> tuple[RecoveryRow, ...]:
    """Return one row for each parameter and nominal level."""
    bias = (recovered.mean - recovered.truth).mean(axis=0)
    contraction = 1.0 - recovered.variance.mean(axis=0) / prior_variance(prior)
    return tuple(
        _row(name, nominal, recovered.level_of_truth[:, j], float(bias[j]), float(contraction[j]), settings)
        for j, name in enumerate(THETA_NAMES)
        for nominal in settings.nominal_levels
    )


def shares(total: int, parts: int) -> list[int]:
    """Share ``total`` recordings out over ``parts`` subjects as evenly as can be, the first getting more."""
    return [len(part) for part in np.array_split(np.arange(total), parts)]


def _row(
    name: str,
    nominal: float,
    level: FloatArray,
    bias: float,
    contraction: float,
    settings: CoverageSettings,
) -> RecoveryRow:
    from scipy.stats import binomtest

    lower, upper = interval_levels(nominal)
    covered = int(np.sum((level >= lower) & (level <= upper)))
    interval = binomtest(covered, len(level)).proportion_ci(settings.confidence, method="exact")
    return RecoveryRow(
        parameter=name,
        nominal=nominal,
        coverage=covered / len(level),
        ci_low=float(interval.low),
        ci_high=float(interval.high),
        n=len(level),
        bias=bias,
        contraction=contraction,
    )
