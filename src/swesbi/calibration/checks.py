"""The checks of calibration, each a row of ``calibration.csv``: uniform ranks, coverage, and contraction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from swesbi.calibration.levels import FloatArray, central_level
from swesbi.calibration.scores import Scores
from swesbi.calibration.uniformity import uniformity

JOINT = "joint"
SBC, COVERAGE, TARP, CONTRACTION, C2ST = "sbc", "coverage", "tarp", "contraction", "c2st"
REPORTED_LEVEL = 0.9


@dataclass(frozen=True)
class Check:
    """One check; the fields are columns of ``calibration.csv``.

    Attributes:
        test: "sbc" (ranks uniform), "coverage" (of central intervals, all nominal levels), "tarp" (joint
            coverage, all levels), "contraction", or "c2st" (two samples told apart).
        quantity: What was ranked; "joint" for all parameters together.
        n: Recordings, or draws of each sample for "c2st".
        statistic: Largest distance of the distribution function from the uniform one; the contraction;
            or the accuracy of the classifier.
        p_value: Of the simultaneous test; NaN where the check has none.
        limit: What flags: a p-value below it, a contraction below it, an accuracy above it.
        flagged: Whether the check fails.
        coverage_90: Share of truths in the central 90 % interval (the 90 % region for "tarp"); NaN where
            there is none.
        contraction: 1 - mean posterior variance / prior variance of the quantity; NaN where it has none.
    """

    test: str
    quantity: str
    n: int
    statistic: float
    p_value: float
    limit: float
    flagged: bool
    coverage_90: float
    contraction: float


def check_scores(
    scores: Scores,
    prior_variance: FloatArray,
    names: Sequence[str],
    alpha: float,
    least_contraction: float,
    groups: int = 1,
) -> tuple[Check, ...]:
    """Judge the posteriors of n recordings by ranks, coverage and contraction.

    The bands of ranks and of marginal coverage each hold over all quantities at once with probability
    1 - alpha (Bonferroni), and over ``groups`` such sets where several are looked at together.

    Args:
        scores: Posteriors of n recordings.
        prior_variance: Prior variance of each quantity for each recording; shape (n, q), NaN for none.
        names: Names of the q quantities.
        alpha: Probability of a false alarm.
        least_contraction: Less than this says that the data were hardly used.
        groups: Sets of tests that share alpha.
    """
    held = _contraction(scores, prior_variance)
    limit = alpha / len(names) / groups
    checks: list[Check] = []
    for test, levels in ((SBC, scores.level), (COVERAGE, central_level(scores.level))):
        for j, name in enumerate(names):
            covered = _covered(scores.level[:, j])
            checks.append(_uniform(test, name, levels[:, j], limit, covered, float(held[j])))
    within = float(np.mean(scores.tarp <= REPORTED_LEVEL))
    checks.append(_uniform(TARP, JOINT, scores.tarp, alpha / groups, within, np.nan))
    checks.extend(_contracted(names, held, len(scores.tarp), least_contraction))
    return tuple(checks)


def flagged(checks: Sequence[Check], *tests: str) -> tuple[str, ...]:
    """Return the quantities that checks of these tests flag, each once; all tests where none is named."""
    wanted = tests or (SBC, COVERAGE, TARP, CONTRACTION, C2ST)
    return tuple(dict.fromkeys(c.quantity for c in checks if c.flagged and c.test in wanted))


def c2st_check(quantity: str, n: int, accuracy: float, limit: float) -> Check:
    """Return the row of a classifier that tells two samples of n draws apart; NaN is flagged, too."""
    return Check(C2ST, quantity, n, accuracy, np.nan, limit, not accuracy <= limit, np.nan, np.nan)


def _contraction(scores: Scores, prior_variance: FloatArray) -> FloatArray:
    return np.asarray(1.0 - (scores.sd**2).mean(axis=0) / prior_variance.mean(axis=0))


def _covered(level: FloatArray) -> float:
    return float(np.mean(central_level(level) <= REPORTED_LEVEL))


def _uniform(
    test: str, name: str, level: FloatArray, limit: float, covered: float, contraction: float
) -> Check:
    found = uniformity(level)
    flag = found.p_value < limit
    return Check(test, name, found.n, found.distance, found.p_value, limit, flag, covered, contraction)


def _contracted(names: Sequence[str], held: FloatArray, n: int, least: float) -> Iterator[Check]:
    for name, value in zip(names, held, strict=True):
        if not np.isnan(value):
            value = float(value)
            yield Check(CONTRACTION, name, n, value, np.nan, least, value < least, np.nan, value)
