"""Null distributions for a subject who has none: those of other subjects, or of a population.

What the posterior is asked (normal scores and ratios of masses) hardly depends on the subject in its null
distribution. The whitened space and the distances in it do, and are made anew for the subject. How well that
holds is measured by judging each subject with the nulls of the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import xarray as xr

from swesbi import artefacts
from swesbi.base.arrays import FloatArray, below_each_other
from swesbi.base.progress import Progress
from swesbi.context import Context
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.settings import summary_names
from swesbi.networks.flow.conditioning import ConditioningSettings, raw_features
from swesbi.networks.flow.flow import TrainedFlow
from swesbi.population.recordings import (
    OWN,
    FreshSettings,
    fresh_subject,
    record_fresh,
    recorded,
)
from swesbi.population.settings import NullSettings
from swesbi.population.synthetic import own_recordings
from swesbi.posterior.settings import ExactSettings
from swesbi.recording.observation import context_values, contexts_of
from swesbi.seeds import generator, integer_seed
from swesbi.verdict.nulls import Reference, Statistics, fit_joint_null, score_scale, space_distances
from swesbi.verdict.pushes import PushChecks
from swesbi.verdict.recordings import NULL, SubjectChecks, posterior_draws
from swesbi.verdict.settings import RuleSettings
from swesbi.verdict.statistics import (
    BOUNDS,
    DISTANCES,
    MEMBERS,
    WITH_STRIPS,
    Checks,
    FeatureSpace,
    check_recording,
    fit_feature_space,
    prior_strip_mass,
)

STREAM = "population null"
ALONG: Final = "recording"
PUSHES: Final = "pushes"
"""The group of free-running null recordings."""
LABELS: Final[dict[str, Any]] = {
    "distance": list(DISTANCES),
    "bounded": list(WITH_STRIPS),
    "bound": list(BOUNDS),
}


def prior_predictive(
    model: SpeedModel, conditioning: ConditioningSettings, count: int, seed: int, *name: str | int
) -> tuple[FloatArray, FloatArray]:
    """Draw features of prior predictive recordings: those that make the space, and as many others; (n, F)."""

    def features(part: str) -> FloatArray:
        made = own_recordings(model, count, seed, *name, part)
        speeds = np.stack([recording.speed_m_s for recording in made.recordings])
        return raw_features(speeds, model.recording.phase, conditioning)

    return features("reference"), features("null")


@dataclass(frozen=True)
class PooledNull:
    """Null recordings of others, n of them.

    Spaces of other phases have other dimensions, so distances are compared by their rank among those of the
    same subject, within (0, 1), in the order of ``DISTANCES``.
    """

    distance_level: Annotated[
        FloatArray,
        artefacts.Variable(
            "recording distance", "1", "share of the subject's own prior predictive that lies nearer"
        ),
    ]
    checks: Annotated[Checks, artefacts.Part(words={"features": "features S(.)", "bound": ""})]
    feature_names: Annotated[tuple[str, ...], artefacts.Labels("feature")]
    prior_mass: Annotated[
        FloatArray,
        artefacts.Variable("bounded bound", "1", "prior mass in the strip there", "prior_strip_mass"),
    ]


def pool_subjects(pool: Sequence[SubjectChecks], settings: RuleSettings) -> PooledNull:
    """Put the null recordings of subjects together, at least one; each has its own space.

    Raises:
        ValueError: The features differ among subjects.
    """
    first = pool[0]
    if any(subject.feature_names != first.feature_names for subject in pool):
        raise ValueError("the subjects' misspecification tests are of different features; rerun the study")
    return PooledNull(
        np.concatenate([_distance_level(subject, settings) for subject in pool]),
        below_each_other([subject.recordings[NULL] for subject in pool]),
        first.feature_names,
        first.prior_mass,
    )


def pooled_reference(
    null: PooledNull, predictive: tuple[FloatArray, FloatArray], settings: RuleSettings
) -> Reference:
    """Return the tests for a new subject, with the null recordings of others.

    Args:
        null: The null recordings.
        predictive: Of the new subject, as of :func:`prior_predictive`: they make its space, and the null
            distributions of distances in it.
        settings: The tests' choices and the levels.
    """
    statistics = Statistics(
        space=_space(predictive[0], settings),
        feature_names=null.feature_names,
        score_scale=score_scale(null.checks.tails),
        prior_mass=null.prior_mass,
        strip_level=settings.strained_level,
    )
    made = statistics.distances(predictive[1])
    distances = {
        name: np.quantile(made[name], null.distance_level[:, column]) for column, name in enumerate(DISTANCES)
    }
    joint = fit_joint_null(statistics.table(null.checks, distances), MEMBERS, settings.tail_fraction)
    return Reference(statistics, joint, settings.strained_level, settings.contradicted_level)


def _space(features: FloatArray, settings: RuleSettings) -> FeatureSpace:
    return fit_feature_space(features, settings.whitened_variance, settings.neighbours)


def _distance_level(subject: SubjectChecks, settings: RuleSettings) -> FloatArray:
    from scipy.stats import rankdata

    distances = space_distances(
        _space(subject.reference_features, settings), subject.recordings[NULL].features
    )
    columns = [rankdata(distances[name]) / (len(distances[name]) + 1.0) for name in DISTANCES]
    return np.stack(columns, axis=1)


@dataclass(frozen=True)
class PopulationNull:
    """Well-specified recordings of fresh contexts, and what the tests look at in each.

    Attributes:
        contexts: Of n gated recordings.
        pooled: What the tests look at in these.
        pushes: The same of m free-running recordings.
    """

    contexts: tuple[Context, ...]
    pooled: Annotated[PooledNull, artefacts.Part()]
    pushes: Annotated[PushChecks, artefacts.Part(group=PUSHES)]


def draw_null(
    index: Sequence[int],
    flow: TrainedFlow,
    fresh: FreshSettings,
    conditioning: ConditioningSettings,
    settings: NullSettings,
    exact: ExactSettings,
    rule: RuleSettings,
    seed: int,
) -> tuple[tuple[Context, ...], PooledNull]:
    """Make and infer the numbered gated recordings of the null; return their contexts as well.

    Args:
        index: Numbers of the recordings.
        flow: The trained network.
        fresh: Where recordings come from.
        conditioning: How speeds become features.
        settings: Sizes.
        exact: The study's own settings of the exact posterior.
        rule: How distances are taken.
        seed: The study's seed.
    """
    progress = Progress("null recordings", len(index), unit="recording")
    contexts, checks, levels = [], [], []
    for number in index:
        subject = fresh_subject(number, fresh, seed, STREAM)
        model = recorded(subject, record_fresh(subject, OWN, fresh, seed, STREAM))
        stream = integer_seed(seed, STREAM, number)
        posterior = posterior_draws(model, flow, settings.effective_draws, exact, stream)
        rng = generator(stream, "replicated")
        recording_checks = check_recording(model, posterior, conditioning, settings.strip_fraction, rng)
        contexts.append(subject.context)
        checks.append(recording_checks)
        levels.append(_levels(model, recording_checks, conditioning, settings, rule, seed))
        progress.step()
    mass = prior_strip_mass(fresh.model.prior, settings.strip_fraction)
    names = summary_names(conditioning.summary)
    return tuple(contexts), PooledNull(np.stack(levels), below_each_other(checks), names, mass)


def _levels(
    model: SpeedModel,
    checks: Checks,
    conditioning: ConditioningSettings,
    settings: NullSettings,
    rule: RuleSettings,
    seed: int,
) -> FloatArray:
    count = settings.predictive_recordings
    reference, others = prior_predictive(model, conditioning, count, seed, STREAM)
    space = _space(reference, rule)
    null, distances = space_distances(space, others), space_distances(space, checks.features)
    return np.array(
        [(np.sum(null[name] < distances[name]) + 0.5) / (len(others) + 1.0) for name in DISTANCES]
    )


SCHEMA: Final = artefacts.schema_of(PopulationNull)
ROOT: Final = artefacts.schema_of(Context, ALONG)["/"] | SCHEMA["/"]
KIND: Final = artefacts.register(
    "population_null",
    {**SCHEMA, "/": ROOT},
    (*LABELS, *artefacts.labels_of(PopulationNull), artefacts.Labels(ALONG, "subject")),
)


def null_groups(null: PopulationNull) -> dict[str, xr.Dataset]:
    """Return the null recordings, gated ones at the root, as datasets with dimension recording."""
    labels = {
        "subject": (ALONG, [context.subject for context in null.contexts]),
        "distance": LABELS["distance"],
        "feature": list(null.pooled.feature_names),
    }
    values = artefacts.values_of(null)
    root = artefacts.build_dataset(ROOT, values["/"] | context_values(null.contexts), labels | LABELS)
    numbers = {"subject": (ALONG, [str(number) for number in range(len(null.pushes.pushes))])}
    return {"/": root, PUSHES: artefacts.build_dataset(SCHEMA[PUSHES], values[PUSHES], numbers | LABELS)}


def read_null(path: Path) -> PopulationNull:
    """Read the null recordings with the contexts of the gated ones.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    groups = {group: artefacts.load(path, KIND, group)[0] for group in SCHEMA}
    return artefacts.from_groups(PopulationNull, groups, {"contexts": contexts_of(groups["/"], ALONG)})
