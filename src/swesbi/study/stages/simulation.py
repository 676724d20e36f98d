"""Simulations from the prior, of a subject or over a population, and the training sets made of them."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from pydantic import Field

from swesbi.artefacts import ArtefactError, Origin, save
from swesbi.artefacts.typed import BySubject, read_as
from swesbi.base.settings import Settings
from swesbi.heart.prior_simulations import PriorSimulations
from swesbi.measurement.likelihood import MeasuredSubject, SpeedModelSettings, read_measured_subjects
from swesbi.measurement.settings import MeasurementSettings, SummarySettings, summary_names, summary_units
from swesbi.networks.flow.pool import KIND as SPEED_POOL
from swesbi.networks.flow.pool import pool_dataset
from swesbi.networks.paper.pool import POOL, SubjectFeatures, build_pool, components_of, pool_to_dataset
from swesbi.networks.settings import ObservationModelSettings
from swesbi.population.settings import PopulationSettings
from swesbi.population.simulations import KIND as POPULATION
from swesbi.population.simulations import simulate_population
from swesbi.population.simulations import to_dataset as population_to_dataset
from swesbi.recording.observation import Observation

LOGGER = logging.getLogger("swesbi")
SHARED = "cycle_phase"  # the one array of simulations that has no row for each


class PopulationSimulateStageSettings(Settings):
    """What a shard depends on."""

    contexts: tuple[int, int]
    draws_per_context: int
    phases: int
    population: PopulationSettings
    model: SpeedModelSettings


def population_simulate(*, shard: Path, settings: PopulationSimulateStageSettings, origin: Origin) -> None:
    """Simulate the contexts numbered from the first to before the second of ``settings.contexts``.

    Raises:
        SimulationFailure: A draw failed too often.
        ValueError: The reference beat of a context does not become periodic.
    """
    made = simulate_population(
        range(*settings.contexts),
        settings.draws_per_context,
        settings.population,
        settings.phases,
        settings.model,
        origin.seed,
        f"simulations {shard.parent.parent.name} {shard.stem}",
    )
    save(shard, population_to_dataset(made), origin.provenance(POPULATION, settings))
    failed, drawn = int(made.failures.sum()), made.theta.shape[0] * made.theta.shape[1]
    LOGGER.info("%d contexts, %d simulations, %d failed and drawn again", len(made.contexts), drawn, failed)


class PoolStageSettings(Settings):
    """What the pool depends on."""

    simulations_per_subject: int = Field(ge=1, description="the first so many draws of each subject")
    measurement: MeasurementSettings
    summary: SummarySettings
    observation_model: ObservationModelSettings


def pool(
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
    subjects = read_measured_subjects(observations, passives, settings.measurement)
    by_subject = read_as(BySubject[PriorSimulations], shards, "shards")
    features = [_features(subject, by_subject, settings) for subject in subjects]
    components = components_of(summary_names(settings.summary), summary_units(settings.summary))
    built = build_pool(features, components, settings.observation_model, origin.seed)
    save(pool, pool_to_dataset(built), origin.provenance(POOL, settings))
    LOGGER.info("pool: %d subjects, %d rows of %d components", len(subjects), *built.z.shape)


def _features(
    subject: MeasuredSubject, shards: BySubject[PriorSimulations], settings: PoolStageSettings
) -> SubjectFeatures:
    name, wanted = subject.observation.subject, settings.simulations_per_subject
    simulations = shards[name]
    if (given := len(simulations.theta)) < wanted:
        raise ArtefactError(f"subject {name}: {given} simulations given, {wanted} wanted; simulate it first")
    return SubjectFeatures(
        context=subject.observation.context,
        draw_index=simulations.draw_index[:wanted],
        theta=simulations.theta[:wanted],
        features=subject.simulated_features(
            simulations.cycle_phase, simulations.active_stiffness_kpa[:wanted], settings.summary
        ),
        observed=subject.observed_features(settings.summary),
    )


class SpeedPoolStageSettings(Settings):
    """What the training set depends on."""

    simulations_per_subject: int
    measurement: MeasurementSettings


def speed_pool(
    *,
    observations: Sequence[Path],
    shards: Sequence[Path],
    pool: Path,
    settings: SpeedPoolStageSettings,
    origin: Origin,
) -> None:
    """Take the simulations of every subject at the measured phases of its recording.

    Raises:
        ArtefactError: A subject has no simulations, or too few.
    """
    by_subject = read_as(BySubject[PriorSimulations], shards, "shards")
    parts = []
    for path in observations:
        observed = Observation.read(path)
        parts.append((observed, _simulations(observed, by_subject, settings.simulations_per_subject)))
    save(pool, pool_dataset(parts, settings.measurement), origin.provenance(SPEED_POOL, settings))
    LOGGER.info("%d subjects, %d simulations each", len(parts), settings.simulations_per_subject)


def _simulations(observed: Observation, shards: BySubject[PriorSimulations], wanted: int) -> PriorSimulations:
    if observed.subject not in shards:
        raise ArtefactError(f"no simulations of subject {observed.subject} are given")
    simulated = shards[observed.subject]
    if len(simulated.theta) < wanted:
        raise ArtefactError(
            f"subject {observed.subject}: {len(simulated.theta)} simulations, {wanted} wanted; "
            "delete its shards and rerun"
        )
    return simulated.first(wanted)
