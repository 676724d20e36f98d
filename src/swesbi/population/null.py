"""Nulls of the misspecification tests over a population, for subjects who have none of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import Part
from swesbi.context import Context
from swesbi.flow.conditioning import ConditioningSettings
from swesbi.flow.net import TrainedFlow
from swesbi.misspecification.bounds import prior_strip_mass
from swesbi.misspecification.checks import DISTANCES, Checks, check_recording, stack_checks
from swesbi.misspecification.feature_space import fit_feature_space
from swesbi.misspecification.pooled import PooledNull, prior_predictive
from swesbi.misspecification.posteriors import weighted_posterior
from swesbi.misspecification.reference import space_distances
from swesbi.misspecification.settings import RuleSettings
from swesbi.observation.settings import summary_names
from swesbi.population.recordings import (
    OWN,
    FreshSettings,
    FreshSubject,
    fresh_subject,
    record_fresh,
    recorded,
)
from swesbi.population.settings import NullSettings
from swesbi.progress import Progress
from swesbi.seeds import generator, integer_seed
from swesbi.speed_model.model import SpeedModel

FloatArray = NDArray[np.float64]
STREAM = "population null"


@dataclass(frozen=True)
class PopulationNull:
    """Well-specified recordings of fresh contexts, n of them, and what the tests look at in each."""

    contexts: tuple[Context, ...]
    pooled: Annotated[PooledNull, Part()]


def draw_null(
    index: Sequence[int],
    flow: TrainedFlow,
    fresh: FreshSettings,
    conditioning: ConditioningSettings,
    settings: NullSettings,
    rule: RuleSettings,
    seed: int,
) -> PopulationNull:
    """Make and infer the numbered recordings of the null.

    Args:
        index: Numbers of the recordings.
        flow: The trained network.
        fresh: Where recordings come from.
        conditioning: How speeds become features.
        settings: Sizes.
        rule: How distances are taken.
        seed: The study's seed.
    """
    progress = Progress("null recordings", len(index), unit="recording")
    contexts, checks, levels = [], [], []
    for number in index:
        subject = fresh_subject(number, fresh, seed, STREAM)
        model = recorded(subject, record_fresh(subject, OWN, fresh, seed, STREAM))
        found = _check(model, flow, conditioning, settings, integer_seed(seed, STREAM, number))
        contexts.append(subject.context)
        checks.append(found)
        levels.append(_levels(subject, found, conditioning, settings, rule, seed))
        progress.step()
    mass = prior_strip_mass(fresh.model.prior, settings.strip_fraction)
    names = summary_names(conditioning.summary)
    return PopulationNull(tuple(contexts), PooledNull(np.stack(levels), stack_checks(checks), names, mass))


def _check(
    model: SpeedModel,
    flow: TrainedFlow,
    conditioning: ConditioningSettings,
    settings: NullSettings,
    seed: int,
) -> Checks:
    posterior = weighted_posterior(model, flow, settings, seed)
    rng = generator(seed, "replicated")
    return check_recording(model, posterior, conditioning, settings.strip_fraction, rng)


def _levels(
    subject: FreshSubject,
    checks: Checks,
    conditioning: ConditioningSettings,
    settings: NullSettings,
    rule: RuleSettings,
    seed: int,
) -> FloatArray:
    made = prior_predictive(subject.model, conditioning, settings.predictive_recordings, seed, STREAM)
    space = fit_feature_space(made.reference, rule.whitened_variance, rule.neighbours)
    null, own = space_distances(space, made.null), space_distances(space, checks.features)
    return np.array([(np.sum(null[name] < own[name]) + 0.5) / (len(made.null) + 1.0) for name in DISTANCES])
