"""Null distributions for a subject who has none: those of other subjects, pooled.

What the posterior is asked (normal scores and ratios of masses) hardly depends on the subject in its null
distribution. The whitened space and the distances in it do, and are made anew for the subject. How well that
holds is measured by judging each subject with the nulls of the others (docs/calibration.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from swesbi.artefacts import Labels, Part, Variable
from swesbi.flow.conditioning import ConditioningSettings, raw_features
from swesbi.misspecification.checks import DISTANCES, MEMBERS, Checks, stack_checks
from swesbi.misspecification.dataset import NULL, SubjectChecks
from swesbi.misspecification.feature_space import FeatureSpace, fit_feature_space
from swesbi.misspecification.null import fit_joint_null
from swesbi.misspecification.reference import Reference, Statistics, score_scale, space_distances
from swesbi.misspecification.settings import RuleSettings
from swesbi.speed_model.model import SpeedModel
from swesbi.speed_model.synthetic import own_recordings

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


def prior_predictive(
    model: SpeedModel, conditioning: ConditioningSettings, count: int, seed: int, *name: str | int
) -> PriorPredictive:
    """Draw features of prior predictive recordings: those that make the space, and as many others."""

    def features(part: str) -> FloatArray:
        made = own_recordings(model, count, seed, *name, part)
        speeds = np.stack([one.speed_m_s for one in made.recordings])
        return raw_features(speeds, model.recording.phase, conditioning)

    return PriorPredictive(features("reference"), features("null"))


@dataclass(frozen=True)
class PooledNull:
    """Null recordings of others, n of them.

    Spaces of other phases have other dimensions, so distances are compared by their rank among those of the
    same subject, within (0, 1), in the order of ``DISTANCES``.
    """

    distance_level: Annotated[
        FloatArray,
        Variable("recording distance", "1", "share of the subject's own prior predictive that lies nearer"),
    ]
    checks: Annotated[Checks, Part(words={"features": "features S(.)", "bound": ""})]
    feature_names: Annotated[tuple[str, ...], Labels("feature")]
    prior_mass: Annotated[
        FloatArray, Variable("parameter bound", "1", "prior mass in the strip there", "prior_strip_mass")
    ]


def pool_subjects(pool: Sequence[SubjectChecks], settings: RuleSettings) -> PooledNull:
    """Put the null recordings of subjects together, at least one; each has its own space.

    Raises:
        ValueError: The features differ among subjects.
    """
    first = pool[0]
    if any(one.feature_names != first.feature_names for one in pool):
        raise ValueError("the subjects' misspecification tests are of different features; rerun the study")
    return PooledNull(
        np.concatenate([_distance_level(one, settings) for one in pool]),
        stack_checks([one.recordings[NULL] for one in pool]),
        first.feature_names,
        first.prior_mass,
    )


def pooled_reference(null: PooledNull, predictive: PriorPredictive, settings: RuleSettings) -> Reference:
    """Return the tests for a new subject, with the null recordings of others.

    Args:
        null: The null recordings.
        predictive: The new subject's space, and the null distributions of distances in it.
        settings: The tests' choices and the levels.
    """
    own = Statistics(
        space=_space(predictive.reference, settings),
        feature_names=null.feature_names,
        score_scale=score_scale(null.checks.tails),
        prior_mass=null.prior_mass,
        strip_level=settings.strained_level,
    )
    made = own.distances(predictive.null)
    distances = {
        name: np.quantile(made[name], null.distance_level[:, column]) for column, name in enumerate(DISTANCES)
    }
    joint = fit_joint_null(own.table(null.checks, distances), MEMBERS, settings.tail_fraction)
    return Reference(own, joint, settings.strained_level, settings.unsupported_level)


def _space(features: FloatArray, settings: RuleSettings) -> FeatureSpace:
    return fit_feature_space(features, settings.whitened_variance, settings.neighbours)


def _distance_level(one: SubjectChecks, settings: RuleSettings) -> FloatArray:
    found = space_distances(_space(one.reference_features, settings), one.recordings[NULL].features)
    columns = [rankdata(found[name]) / (len(found[name]) + 1.0) for name in DISTANCES]
    return np.stack(columns, axis=1)
