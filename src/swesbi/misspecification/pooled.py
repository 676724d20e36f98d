"""Null distributions for a subject who has none: those of other subjects, pooled.

What the posterior is asked (normal scores and ratios of masses) hardly depends on the subject in its null
distribution. The whitened space and the distances in it do, and are made anew for the subject. How well that
holds is measured by judging each subject with the nulls of the others (docs/calibration.md).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from swesbi.misspecification.checks import MEMBERS, TEST_NAMES
from swesbi.misspecification.dataset import NULL, SubjectChecks
from swesbi.misspecification.feature_space import FeatureSpace, fit_feature_space
from swesbi.misspecification.null import fit_joint_null
from swesbi.misspecification.reference import Reference, Statistics, score_scale
from swesbi.misspecification.settings import RuleSettings

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class PriorPredictive:
    """Features of prior predictive recordings of the new subject.

    Attributes:
        reference: Those that make the space; shape (m, F).
        null: Others, for the null distributions of distances in it; shape (n, F).
    """

    reference: FloatArray
    null: FloatArray


def pooled_reference(
    pool: Sequence[SubjectChecks], predictive: PriorPredictive, settings: RuleSettings
) -> Reference:
    """Return the tests for a new subject, with the null recordings of all subjects of the pool.

    Args:
        pool: The subjects whose null recordings are taken, at least one; each has its own space.
        predictive: The new subject's space, and the null distributions of distances in it.
        settings: The tests' choices and the levels.

    Raises:
        ValueError: The pool's features differ among subjects.
    """
    first = pool[0]
    if any(one.feature_names != first.feature_names for one in pool):
        raise ValueError("the subjects' misspecification tests are of different features; rerun the study")
    tails = np.concatenate([one.recordings[NULL].tails for one in pool])
    own = Statistics(
        space=_space(predictive.reference, settings),
        feature_names=first.feature_names,
        score_scale=score_scale(tails),
        prior_mass=first.prior_mass,
        strip_level=settings.strained_level,
    )
    distances = own.distances(predictive.null)
    rows = [_null_statistics(own, distances, one, settings) for one in pool]
    joint = fit_joint_null(np.concatenate(rows), MEMBERS, settings.tail_fraction)
    return Reference(own, joint, settings.strained_level, settings.unsupported_level)


def _space(features: FloatArray, settings: RuleSettings) -> FeatureSpace:
    return fit_feature_space(features, settings.whitened_variance, settings.neighbours)


def _null_statistics(
    own: Statistics, distances: Mapping[str, FloatArray], one: SubjectChecks, settings: RuleSettings
) -> FloatArray:
    """Return the statistics (n, T) of one subject's null recordings, with the new subject's distances.

    Each distance in the other's space is replaced by the one of equal rank in the new subject's: spaces
    of other phases have other dimensions.
    """
    statistics = replace(own, space=_space(one.reference_features, settings)).of(one.recordings[NULL])
    for name, null in distances.items():
        column = TEST_NAMES.index(name)
        statistics[:, column] = np.quantile(null, rankdata(statistics[:, column]) / (len(statistics) + 1.0))
    return statistics
