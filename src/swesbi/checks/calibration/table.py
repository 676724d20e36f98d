"""The checks of calibration: uniform ranks, coverage, contraction, each a row of ``calibration.csv``.

Säilynoja, Bürkner and Vehtari (2022), Graphical test for discrete uniformity and its applications in
goodness-of-fit evaluation and multiple sample comparison, Stat. Comput. 32:32. ArviZ computes the same
bands, but no p-values, which a table of many tests needs; the band here comes from the same null
distribution as the p-value, so that a curve leaves the band exactly where its p-value is below the limit.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Annotated, Final

import numpy as np
import pandas as pd
from scipy.special import bdtr, bdtrc

from swesbi.artefacts.csv import Table
from swesbi.base.arrays import FloatArray, IntArray, rows_of
from swesbi.checks.calibration.ranks import (
    QUANTITY_NAMES,
    SAMPLERS,
    RankedRecordings,
    RankScores,
    TwoSamples,
    central_level,
)
from swesbi.checks.calibration.settings import JudgementSettings
from swesbi.seeds import generator

POINTS: Final = 100
"""Intervals between the points of evaluation; ranks among L draws fit them where L + 1 is a multiple."""
NULL_SAMPLES: Final = 10_000
NULL_SEED: Final = 2022
JOINT = "joint"
SBC, COVERAGE, TARP, CONTRACTION, C2ST = "sbc", "coverage", "tarp", "contraction", "c2st"
REPORTED_LEVEL = 0.9
POOLED: Final = "pooled"
LOCAL: Final = "local"
NONE_LOST: Final = 0.0  # a second recording must not widen the posterior that the first one gave
COLUMNS: Final = (
    "subject", "recordings", "sampler", "test", "quantity", "n", "statistic", "p_value", "limit", "flagged",
    "coverage_90", "contraction",
)  # fmt: skip
TABLE: Final = Table(columns=COLUMNS)
CalibrationTable = Annotated[pd.DataFrame, TABLE]
"""``calibration.csv``."""


@dataclass(frozen=True)
class Uniformity:
    """The test of one sample.

    Attributes:
        n: Size of the sample.
        difference: Distribution function less the uniform one at :func:`points`; shape (POINTS - 1,).
        distance: Its largest absolute value.
        p_value: Probability that a uniform sample comes as near to leaving some band at some point.
    """

    n: int
    difference: FloatArray
    distance: float
    p_value: float


def points() -> FloatArray:
    """Return where distribution functions are evaluated: the inner multiples of 1/POINTS."""
    return np.asarray(np.arange(1, POINTS) / POINTS)


def uniformity(sample: FloatArray) -> Uniformity:
    """Test a sample of levels in [0, 1], shape (n,), for uniformity.

    Raises:
        ValueError: The sample is empty or holds NaN.
    """
    if not len(sample) or np.isnan(sample).any():
        raise ValueError(f"a test of uniformity needs levels without NaN, got {len(sample)} of them")
    counts = np.searchsorted(np.sort(sample), points(), side="right")
    tail = float(_smallest_tail(counts, len(sample)))
    null = _null_tails(len(sample))
    difference = counts / len(sample) - points()
    # the sample counts as one of the null's, so that no p-value is 0 and the test keeps its level
    p_value = (1.0 + np.searchsorted(null, tail, side="right")) / (1.0 + len(null))
    return Uniformity(len(sample), difference, float(np.abs(difference).max()), float(p_value))


def band(n: int, level: float) -> tuple[FloatArray, FloatArray]:
    """Return the limits of the difference that a uniform sample leaves anywhere with probability ``level``.

    At each point they are the quantiles of a binomial distribution, all at the same pointwise level, which is
    chosen such that the band holds at all points at once.

    Args:
        n: Size of the sample.
        level: Probability of leaving the band, such as 0.05.
    """
    from scipy.stats import binom

    # a tail that the null has, not one between two: counts are discrete, and so are their tails
    pointwise = float(np.quantile(_null_tails(n), level, method="lower"))
    low = binom.ppf(pointwise / 2.0, n, points()) / n - points()
    high = binom.isf(pointwise / 2.0, n, points()) / n - points()
    return np.asarray(low), np.asarray(high)


def _smallest_tail(counts: IntArray, n: int) -> FloatArray:
    """Return twice the smallest binomial tail probability over the points, of counts (..., points)."""
    lower, upper = _tails(n)
    # neighbouring points hardly differ, so that Bonferroni over them would make bands far too wide: the null
    # distribution of the smallest tail takes their dependence into account
    at = np.arange(POINTS - 1)
    tails: FloatArray = np.minimum(lower[counts, at], upper[counts, at]).min(axis=-1)
    return 2.0 * tails


@lru_cache(maxsize=32)
def _tails(n: int) -> tuple[FloatArray, FloatArray]:
    """Return P(count <= k) and P(count >= k) for k = 0..n (rows) at each point (columns)."""
    k = np.arange(n + 1)[:, None]
    return np.asarray(bdtr(k, n, points())), np.asarray(bdtrc(k - 1, n, points()))


@lru_cache(maxsize=32)
def _null_tails(n: int) -> FloatArray:
    """Return the sorted smallest tails of uniform samples of size n; a fixed stream for each size."""
    rng = generator(NULL_SEED, "uniformity", n)
    # a distribution function is only seen at the points: the counts between them are multinomial
    counts = rng.multinomial(n, np.full(POINTS, 1.0 / POINTS), size=NULL_SAMPLES)
    return np.sort(_smallest_tail(counts.cumsum(axis=1)[:, :-1], n))


@dataclass(frozen=True)
class Check:
    """One check; the fields are columns of ``calibration.csv``.

    Attributes:
        test: "sbc" (ranks uniform), "coverage" (of central intervals, all nominal levels), "tarp" (joint
            coverage, all levels), "contraction", or "c2st" (a classifier between two samples).
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
    scores: RankScores,
    prior_variance: FloatArray,
    names: Sequence[str],
    alpha: float,
    least_contraction: float,
    groups: int = 1,
) -> tuple[Check, ...]:
    """Judge the posteriors of n recordings by ranks, coverage and, but for nuisances, contraction.

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
    held = 1.0 - (scores.sd**2).mean(axis=0) / prior_variance.mean(axis=0)
    limit = alpha / len(names) / groups
    checks: list[Check] = []
    for test, levels in ((SBC, scores.level), (COVERAGE, central_level(scores.level))):
        for j, name in enumerate(names):
            covered = float(np.mean(central_level(scores.level[:, j]) <= REPORTED_LEVEL))
            checks.append(_uniform(test, name, levels[:, j], limit, covered, float(held[j])))
    within = float(np.mean(scores.tarp <= REPORTED_LEVEL))
    checks.append(_uniform(TARP, JOINT, scores.tarp, alpha / groups, within, np.nan))
    for name, value in zip(names, held.tolist(), strict=True):
        if name in QUANTITY_NAMES and not np.isnan(value):
            of = CONTRACTION, name, len(scores.tarp), value, np.nan, least_contraction
            checks.append(Check(*of, value < least_contraction, np.nan, value))
    return tuple(checks)


def flagged(checks: Sequence[Check], *tests: str) -> tuple[str, ...]:
    """Return the quantities that checks of these tests flag, each once; all tests where none is named."""
    wanted = tests or (SBC, COVERAGE, TARP, CONTRACTION, C2ST)
    return tuple(dict.fromkeys(c.quantity for c in checks if c.flagged and c.test in wanted))


def c2st_check(quantity: str, n: int, accuracy: float, limit: float) -> Check:
    """Return the row of a classifier that tells two samples of n draws apart; NaN is flagged, too."""
    return Check(C2ST, quantity, n, accuracy, np.nan, limit, not accuracy <= limit, np.nan, np.nan)


def _uniform(
    test: str, name: str, level: FloatArray, limit: float, covered: float, contraction: float
) -> Check:
    of = uniformity(level)
    return Check(test, name, of.n, of.distance, of.p_value, limit, of.p_value < limit, covered, contraction)


def calibration_table(
    ranked: Mapping[str, RankedRecordings], two_samples: TwoSamples, settings: JudgementSettings
) -> pd.DataFrame:
    """Return one row a check.

    ``limit`` is shared (Bonferroni) by the quantities of one set of bands, and in rows of single subjects by
    the subjects too. At the subjects' own data ("local") contraction is against the posterior given the
    first recording, and must only be above zero: how much more a second one tells is the subject's matter.
    In rows of "c2st", ``sampler`` is the pair that is compared.

    Args:
        ranked: Recordings by how they were made: "model_noise", "sample_by_sample" or "local".
        two_samples: Accuracies of classifiers by subject and pair of samplers.
        settings: What is asked.
    """
    rows = [row for name, recordings in ranked.items() for row in _of_recordings(name, recordings, settings)]
    rows.extend(_of_two_samples(two_samples, settings.max_c2st))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _of_recordings(
    name: str, ranked: RankedRecordings, settings: JudgementSettings
) -> Iterator[dict[str, object]]:
    subjects = list(dict.fromkeys(ranked.subject.tolist()))
    parts = {subject: rows_of(ranked, ranked.subject == subject) for subject in subjects}
    for sampler in SAMPLERS:
        if name != LOCAL:
            checks = _checks(ranked, sampler, settings, settings.least_contraction, 1)
            yield from _labelled(POOLED, name, sampler, checks)
        for subject, of_subject in parts.items():
            least = settings.least_contraction if name != LOCAL else NONE_LOST
            checks = _checks(of_subject, sampler, settings, least, len(subjects))
            yield from _labelled(subject, name, sampler, checks)


def _checks(
    ranked: RankedRecordings, sampler: str, settings: JudgementSettings, least: float, groups: int
) -> tuple[Check, ...]:
    return check_scores(
        ranked.of(sampler), ranked.prior_variance, ranked.names, settings.alpha, least, groups
    )


def _of_two_samples(two_samples: TwoSamples, limit: float) -> Iterator[dict[str, object]]:
    for i, subject in enumerate(two_samples.subject):
        for j, pair in enumerate(two_samples.pair):
            draws, accuracy = two_samples.draws[i, j], two_samples.accuracy[i, j]
            if np.isnan(draws):  # of this subject there are no long chains
                continue
            check = c2st_check("joint", int(draws), float(accuracy), limit)
            yield from _labelled(subject, LOCAL, pair, (check,))


def _labelled(
    subject: str, recordings: str, sampler: str, checks: tuple[Check, ...]
) -> Iterator[dict[str, object]]:
    for check in checks:
        labels = {"subject": subject, "recordings": recordings, "sampler": sampler}
        yield labels | asdict(check) | {"flagged": int(check.flagged)}
