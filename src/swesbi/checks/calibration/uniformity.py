"""The test of uniformity behind ranks and coverage, with its simultaneous band.

Säilynoja, Bürkner and Vehtari (2022), Graphical test for discrete uniformity and its applications in
goodness-of-fit evaluation and multiple sample comparison, Stat. Comput. 32:32. ArviZ computes the same
bands, but no p-values, which a table of many tests needs; the band here comes from the same null
distribution as the p-value, so that a curve leaves the band exactly where its p-value is below the limit.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from scipy.special import bdtr, bdtrc

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.seeds import generator

POINTS: Final = 100
"""Intervals between the points of evaluation; ranks among L draws fit them where L + 1 is a multiple."""
NULL_SAMPLES: Final = 10_000
NULL_SEED: Final = 2022


@dataclass(frozen=True)
class Uniformity:
    """The test of one sample: its distribution function less the uniform one at :func:`points`.

    ``distance`` is the largest absolute difference, ``p_value`` the probability that a uniform sample comes
    as near to leaving some band at some point.
    """

    difference: FloatArray
    distance: float
    p_value: float


def points() -> FloatArray:
    """Return where distribution functions are evaluated: the inner multiples of 1/POINTS."""
    return np.asarray(np.arange(1, POINTS) / POINTS)


def uniformity(sample: FloatArray) -> Uniformity:
    """Test a sample of levels in [0, 1], shape (n,), for uniformity.

    An empty sample, or one with NaN, is refused.
    """
    if not len(sample) or np.isnan(sample).any():
        raise ValueError(f"a test of uniformity needs levels without NaN, got {len(sample)} of them")
    counts = np.searchsorted(np.sort(sample), points(), side="right")
    tail = float(_smallest_tail(counts, len(sample)))
    null = _null_tails(len(sample))
    difference = counts / len(sample) - points()
    # the sample counts as one of the null's, so that no p-value is 0 and the test keeps its level
    p_value = (1.0 + np.searchsorted(null, tail, side="right")) / (1.0 + len(null))
    return Uniformity(difference, float(np.abs(difference).max()), float(p_value))


def band(n: int, level: float) -> tuple[FloatArray, FloatArray]:
    """Return the limits of the difference that a uniform sample of size n leaves with this probability.

    At each point they are quantiles of a binomial distribution, all at the same pointwise level, which is
    chosen such that the band holds at all points at once.
    """
    from scipy.stats import binom

    # a tail that the null has, not one between two: counts are discrete, and so are their tails
    pointwise = float(np.quantile(_null_tails(n), level, method="lower"))
    return (
        np.asarray(binom.ppf(pointwise / 2.0, n, points()) / n - points()),
        np.asarray(binom.isf(pointwise / 2.0, n, points()) / n - points()),
    )


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
