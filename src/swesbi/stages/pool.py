"""Stage: the pooled training set of one experiment."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from pydantic import Field

from swesbi.artefacts import ArtefactError, save
from swesbi.inference.dataset import POOL, pool_to_dataset
from swesbi.inference.pool import SubjectFeatures, build_pool, components_of
from swesbi.inference.settings import ObservationModelSettings
from swesbi.inference.subjects import MeasuredSubject, read_measured_subjects
from swesbi.observation.settings import MeasurementSettings, SummarySettings, summary_names, summary_units
from swesbi.settings import Settings
from swesbi.simulations.dataset import group_by_subject, read_simulations
from swesbi.stages.origin import Origin

LOGGER = logging.getLogger("swesbi")


class PoolStageSettings(Settings):
    """What the pool depends on, beside its input files."""

    simulations_per_subject: int = Field(ge=1, description="the first so many draws of each subject")
    measurement: MeasurementSettings
    summary: SummarySettings
    observation_model: ObservationModelSettings


def run(
    *,
    observations: Sequence[Path],
    passives: Sequence[Path],
    shards: Sequence[Path],
    pool: Path,
    settings: PoolStageSettings,
    origin: Origin,
) -> None:
    """Write the noise-augmented, standardised features and contexts of all subjects (paper, Eq. 7).

    Raises:
        ArtefactError: A subject lacks a recording, a passive baseline or enough simulations.
    """
    subjects = read_measured_subjects(observations, passives)
    by_subject = group_by_subject(shards)
    features = [_features(subject, by_subject, settings) for subject in subjects]
    components = components_of(summary_names(settings.summary), summary_units(settings.summary))
    built = build_pool(features, components, settings.observation_model, origin.seed)
    save(pool, pool_to_dataset(built), origin.provenance(POOL, settings))
    LOGGER.info("pool: %d subjects, %d rows of %d components", len(subjects), *built.z.shape)


def _features(
    subject: MeasuredSubject, shards: dict[str, list[Path]], settings: PoolStageSettings
) -> SubjectFeatures:
    name, wanted = subject.observation.subject, settings.simulations_per_subject
    simulations = read_simulations(shards[name]) if name in shards else None
    found = 0 if simulations is None else len(simulations.theta)
    if simulations is None or found < wanted:
        raise ArtefactError(f"subject {name}: {found} simulations given, {wanted} wanted; simulate it first")
    return SubjectFeatures(
        context=subject.observation.context,
        draw_index=simulations.draw_index[:wanted],
        theta=simulations.theta[:wanted],
        features=subject.simulated_features(
            simulations.cycle_phase,
            simulations.active_stiffness_kpa[:wanted],
            settings.measurement,
            settings.summary,
        ),
        observed=subject.observed_features(settings.summary),
    )
