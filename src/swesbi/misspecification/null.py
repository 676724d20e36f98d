"""Null distributions: p-values of single statistics, and of the most extreme of several.

Below the tail, a p-value is the share of the null at or above the statistic. The tail itself is a
generalised Pareto distribution fitted to its exceedances, so that a statistic beyond all null recordings
still has a p-value (Knijnenburg et al., Bioinformatics 25:i161, 2009). A tail with an end, of negative
shape, is replaced by the exponential one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import genpareto

FloatArray = NDArray[np.float64]
SMALLEST_P: Final = 1e-6
"""A fitted tail of some hundred recordings says nothing about what is rarer."""


@dataclass(frozen=True)
class Null:
    """The null distribution of a statistic whose large values speak against the model.

    Attributes:
        ordered: The null statistics, ascending; shape (n,).
        edge: Where the fitted tail begins.
        edge_p: Share of the null above the edge.
        shape: Shape of the Pareto tail.
        scale: Its scale; zero where the exceedances do not vary.
    """

    ordered: FloatArray
    edge: float
    edge_p: float
    shape: float
    scale: float

    def p_value(self, statistic: FloatArray) -> FloatArray:
        """Return the p-value of each statistic, any shape, between ``SMALLEST_P`` and 1."""
        above = len(self.ordered) - np.searchsorted(self.ordered, statistic, side="left")
        empirical = (1.0 + above) / (1.0 + len(self.ordered))
        if self.scale == 0.0:
            return np.asarray(empirical)
        excess = np.maximum(statistic - self.edge, 0.0)
        tail = self.edge_p * genpareto.sf(excess, self.shape, scale=self.scale)
        return np.clip(np.where(statistic > self.edge, tail, empirical), SMALLEST_P, 1.0)

    def critical(self, level: float) -> float:
        """Return the statistic whose p-value is ``level``; beyond it the p-value is smaller."""
        if self.scale > 0.0 and level < self.edge_p:
            return float(
                self.edge + genpareto.isf(max(level, SMALLEST_P) / self.edge_p, self.shape, scale=self.scale)
            )
        return float(np.quantile(self.ordered, 1.0 - level, method="higher"))


def fit_null(statistics: FloatArray, tail_fraction: float) -> Null:
    """Take the null distribution of n statistics, its upper ``tail_fraction`` by a Pareto tail.

    Raises:
        ValueError: The statistics are not a vector of finite numbers.
    """
    if statistics.ndim != 1 or not np.isfinite(statistics).all():
        raise ValueError(
            f"null statistics must be a vector of finite numbers; found shape {statistics.shape}"
        )
    ordered = np.sort(statistics)
    edge = float(np.quantile(ordered, 1.0 - tail_fraction))
    excess = ordered[ordered > edge] - edge
    if len(excess) < 2 or np.ptp(excess) == 0.0:
        return Null(ordered, edge, len(excess) / len(ordered), 0.0, 0.0)
    shape, _, scale = genpareto.fit(excess, floc=0.0)
    if shape < 0.0:  # a tail that ends would call impossible what no recording happened to show
        shape, scale = 0.0, excess.mean()
    return Null(ordered, edge, len(excess) / len(ordered), float(shape), float(scale))


@dataclass(frozen=True)
class JointNull:
    """Null distributions of T tests in G groups, and of the smallest p-values in them.

    The smallest p-value of a group is judged against the smallest p-values of the null recordings, and so
    is the smallest over the groups: correlated tests cost no more than they must, and each group, whatever
    the number of its tests, has the same share in the false alarms (Westfall and Young 1993).

    Attributes:
        tests: Null of each test, T of them.
        members: The tests of each group, as indices; G of them.
        groups: Null of -log of the smallest p-value in each group; G of them.
        overall: Null of -log of the smallest of the groups' p-values.
    """

    tests: tuple[Null, ...]
    members: tuple[tuple[int, ...], ...]
    groups: tuple[Null, ...]
    overall: Null

    def test_p(self, statistics: FloatArray) -> FloatArray:
        """Return the p-value of every test, from statistics (n, T); shape (n, T)."""
        return np.stack([null.p_value(statistics[:, t]) for t, null in enumerate(self.tests)], axis=1)

    def group_p(self, test_p: FloatArray) -> FloatArray:
        """Return the p-value of every group, from those of the tests (n, T); shape (n, G)."""
        smallest = _smallest(test_p, self.members)
        return np.stack([null.p_value(smallest[:, g]) for g, null in enumerate(self.groups)], axis=1)

    def overall_p(self, test_p: FloatArray) -> FloatArray:
        """Return the p-value of the recording, from those of its tests (n, T); shape (n,)."""
        return self.overall.p_value(-np.log(self.group_p(test_p).min(axis=1)))

    def thresholds(self, level: float) -> FloatArray:
        """Return the p-value below which each test alone brings the overall one below ``level``; (T,)."""
        group_level = float(np.exp(-self.overall.critical(level)))
        limits = np.empty(len(self.tests))
        for members, null in zip(self.members, self.groups, strict=True):
            limits[list(members)] = np.exp(-null.critical(group_level))
        return limits


def fit_joint_null(
    statistics: FloatArray, members: tuple[tuple[int, ...], ...], tail_fraction: float
) -> JointNull:
    """Take the null distributions of T tests and of their combination from null recordings (n, T)."""
    tests = tuple(fit_null(column, tail_fraction) for column in statistics.T)
    p = np.stack([null.p_value(statistics[:, t]) for t, null in enumerate(tests)], axis=1)
    smallest = _smallest(p, members)
    groups = tuple(fit_null(column, tail_fraction) for column in smallest.T)
    group_p = np.stack([null.p_value(smallest[:, g]) for g, null in enumerate(groups)], axis=1)
    return JointNull(tests, members, groups, fit_null(-np.log(group_p.min(axis=1)), tail_fraction))


def _smallest(test_p: FloatArray, members: tuple[tuple[int, ...], ...]) -> FloatArray:
    """Return -log of the smallest p-value in each group; shape (n, G)."""
    return np.stack([-np.log(test_p[:, list(group)].min(axis=1)) for group in members], axis=1)
