"""Null distributions of one subject's tests: p-values, and what they make of recordings.

Below the tail, a p-value is the share of the null at or above the statistic. The tail itself is a
generalised Pareto distribution fitted to its exceedances, so that a statistic beyond all null recordings
still has a p-value (Knijnenburg et al., Bioinformatics 25:i161, 2009). A tail with an end, of negative
shape, is replaced by the exponential one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.verdict.settings import RuleSettings
from swesbi.verdict.statistics import (
    FEATURE_TESTS,
    MEMBERS,
    TEST_NAMES,
    Checks,
    FeatureSpace,
    boundary_statistic,
    fit_feature_space,
    tail_scores,
)
from swesbi.verdict.verdict import GRADES, Status

SMALLEST_P: Final = 1e-6
"""A fitted tail of some hundred recordings says nothing about what is rarer."""
LEAST_SCALE: Final = 0.05  # a feature that hardly ever leaves its predictive median


@dataclass(frozen=True)
class Null:
    """The null distribution of a statistic whose large values contradict the model.

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
        from scipy.stats import genpareto

        excess = np.maximum(statistic - self.edge, 0.0)
        tail = self.edge_p * genpareto.sf(excess, self.shape, scale=self.scale)
        return np.clip(np.where(statistic > self.edge, tail, empirical), SMALLEST_P, 1.0)

    def critical(self, level: float) -> float:
        """Return the statistic whose p-value is ``level``; beyond it the p-value is smaller."""
        if self.scale > 0.0 and level < self.edge_p:
            from scipy.stats import genpareto

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
    from scipy.stats import genpareto

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


class Grade(IntEnum):
    """What a recording amounts to, from good to bad."""

    NOT_CONTRADICTED = 0
    STRAINED = 1
    CONTRADICTED = 2

    @property
    def word(self) -> Status:
        """The grade as files and figures print it."""
        return GRADES[self]


@dataclass(frozen=True)
class Statistics:
    """How recordings become test statistics, all of them large where the model misfits.

    Attributes:
        space: Whitened features of the prior predictive.
        feature_names: Names of the F features.
        score_scale: Root mean square of each feature's normal score over the null; shape (F,).
        prior_mass: Mass of the prior in the strip at each bound; shape (6, 2).
        strip_level: Largest prior mass of a strip that the boundary test looks at.
    """

    space: FeatureSpace
    feature_names: tuple[str, ...]
    score_scale: FloatArray
    prior_mass: FloatArray
    strip_level: float

    def of(self, checks: Checks) -> FloatArray:
        """Return the statistics of n recordings in the order of ``TEST_NAMES``; shape (n, T)."""
        return self.table(checks, self.distances(checks.features))

    def table(self, checks: Checks, distances: Mapping[str, FloatArray]) -> FloatArray:
        """Return the statistics of n recordings (n, T) with the distances (n,) given by name."""
        scores = tail_scores(checks.tails)
        columns = {
            **distances,
            "chi2": checks.chi2_score(),
            "conditional_features": (scores / self.score_scale).max(axis=1),
            "boundary_mass": boundary_statistic(checks.bound_mass, self.prior_mass, self.strip_level),
        }
        for name, feature in FEATURE_TESTS.items():
            columns[name] = scores[:, self.feature_names.index(feature)]
        return np.stack([columns[name] for name in TEST_NAMES], axis=1)

    def distances(self, features: FloatArray) -> dict[str, FloatArray]:
        """Return the statistics (n,) that ask only where the features (n, F) of n recordings lie."""
        return space_distances(self.space, features)

    def worst_features(self, tails: FloatArray) -> IntArray:
        """Return the features (F,) of one recording from the most unlikely to the likeliest, as indices."""
        return np.argsort(-tail_scores(tails) / self.score_scale, kind="stable")


@dataclass(frozen=True)
class Judgement:
    """P-values of n recordings and the verdict that they amount to.

    Attributes:
        statistics: Test statistics; shape (n, T).
        test_p: P-value of each test; shape (n, T).
        group_p: P-value of each group of tests; shape (n, G).
        overall_p: P-value of the recording; shape (n,).
        status: The grades as the integers of :class:`Grade`; shape (n,).
    """

    statistics: FloatArray
    test_p: FloatArray
    group_p: FloatArray
    overall_p: FloatArray
    status: IntArray


@dataclass(frozen=True)
class Reference:
    """The null distributions of one subject and the levels of the verdict."""

    statistics: Statistics
    joint: JointNull
    strained_level: float
    contradicted_level: float

    def judge(self, checks: Checks) -> Judgement:
        """Return the p-values and verdicts of recordings that are not among the null's."""
        statistics = self.statistics.of(checks)
        test_p = self.joint.test_p(statistics)
        overall = self.joint.overall_p(test_p)
        status = (overall <= self.strained_level).astype(np.int64) + (overall <= self.contradicted_level)
        return Judgement(statistics, test_p, self.joint.group_p(test_p), overall, status)


def space_distances(space: FeatureSpace, features: FloatArray) -> dict[str, FloatArray]:
    """Return the distances (n,) of features (n, F) in a space, by the names of their tests."""
    return {
        "mahalanobis": space.mahalanobis(features),
        "nearest_neighbours": space.nearest(features),
        "mmd": space.discrepancy(features),
    }


def score_scale(tails: FloatArray) -> FloatArray:
    """Return the root mean square of each feature's normal score over null recordings (n, F); shape (F,)."""
    return np.asarray(np.maximum(np.sqrt((tail_scores(tails) ** 2).mean(axis=0)), LEAST_SCALE))


def fit_reference(
    null: Checks,
    reference_features: FloatArray,
    feature_names: tuple[str, ...],
    prior_mass: FloatArray,
    settings: RuleSettings,
) -> Reference:
    """Take the null distributions from well-specified recordings of a subject.

    Args:
        null: What the tests look at in the null recordings.
        reference_features: Features of prior predictive recordings, others than the null's; shape (m, F).
        feature_names: Names of the F features.
        prior_mass: Mass of the prior in the strip at each bound; shape (6, 2).
        settings: The tests' choices and the levels.
    """
    space = fit_feature_space(reference_features, settings.whitened_variance, settings.neighbours)
    scale = score_scale(null.tails)
    statistics = Statistics(space, feature_names, scale, prior_mass, settings.strained_level)
    joint = fit_joint_null(statistics.of(null), MEMBERS, settings.tail_fraction)
    return Reference(statistics, joint, settings.strained_level, settings.contradicted_level)
