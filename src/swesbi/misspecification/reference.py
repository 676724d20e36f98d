"""The null distributions of one subject, and what they make of recordings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.misspecification.bounds import boundary_statistic
from swesbi.misspecification.checks import FEATURE_TESTS, MEMBERS, TEST_NAMES, Checks
from swesbi.misspecification.feature_space import FeatureSpace, fit_feature_space
from swesbi.misspecification.null import JointNull, fit_joint_null
from swesbi.misspecification.predictive import tail_scores
from swesbi.misspecification.settings import RuleSettings

FloatArray = NDArray[np.float64]
LEAST_SCALE: Final = 0.05  # a feature that hardly ever leaves its predictive median


class Verdict(IntEnum):
    """The verdict on a subject, from good to bad."""

    SUPPORTED = 0
    STRAINED = 1
    UNSUPPORTED = 2

    @property
    def word(self) -> str:
        """The verdict as files and figures print it."""
        return self.name.lower()


@dataclass(frozen=True)
class Statistics:
    """How recordings become test statistics, all of them large where the model misfits.

    Attributes:
        space: Whitened features of the prior predictive.
        feature_names: Names of the F features.
        score_scale: Root mean square of each feature's normal score over the null; shape (F,).
        prior_mass: Mass of the prior in the strip at each bound; shape (4, 2).
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

    def worst_features(self, tails: FloatArray) -> NDArray[np.int64]:
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
        status: Verdict as the integers of :class:`Verdict`; shape (n,).
    """

    statistics: FloatArray
    test_p: FloatArray
    group_p: FloatArray
    overall_p: FloatArray
    status: NDArray[np.int64]


@dataclass(frozen=True)
class Reference:
    """The null distributions of one subject and the levels of the verdict."""

    statistics: Statistics
    joint: JointNull
    strained_level: float
    unsupported_level: float

    def judge(self, checks: Checks) -> Judgement:
        """Return the p-values and verdicts of recordings that are not among the null's."""
        statistics = self.statistics.of(checks)
        test_p = self.joint.test_p(statistics)
        overall = self.joint.overall_p(test_p)
        status = (overall <= self.strained_level).astype(np.int64) + (overall <= self.unsupported_level)
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
        prior_mass: Mass of the prior in the strip at each bound; shape (4, 2).
        settings: The tests' choices and the levels.
    """
    space = fit_feature_space(reference_features, settings.whitened_variance, settings.neighbours)
    scale = score_scale(null.tails)
    statistics = Statistics(space, feature_names, scale, prior_mass, settings.strained_level)
    joint = fit_joint_null(statistics.of(null), MEMBERS, settings.tail_fraction)
    return Reference(statistics, joint, settings.strained_level, settings.unsupported_level)
