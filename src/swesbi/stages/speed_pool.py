"""Stage: the training set of an experiment on measured speeds."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path

from swesbi.artefacts import ArtefactError, save
from swesbi.flow.pool import KIND, pool_dataset
from swesbi.observation.settings import MeasurementSettings
from swesbi.recording.dataset import read_observation
from swesbi.recording.observation import Observation
from swesbi.settings import Settings
from swesbi.simulations.dataset import group_by_subject, read_simulations
from swesbi.simulations.draw import PriorSimulations
from swesbi.stages.origin import Origin

LOGGER = logging.getLogger("swesbi")
SHARED = "cycle_phase"  # the one array of simulations that has no row for each


class SpeedPoolStageSettings(Settings):
    """What the training set depends on, beside its input files."""

    simulations_per_subject: int
    measurement: MeasurementSettings


def run(
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
    by_subject = group_by_subject(shards)
    parts = []
    for path in observations:
        observed = read_observation(path)
        parts.append((observed, _simulations(observed, by_subject, settings.simulations_per_subject)))
    save(pool, pool_dataset(parts, settings.measurement), origin.provenance(KIND, settings))
    LOGGER.info("%d subjects, %d simulations each", len(parts), settings.simulations_per_subject)


def _simulations(observed: Observation, shards: dict[str, list[Path]], wanted: int) -> PriorSimulations:
    if observed.subject not in shards:
        raise ArtefactError(f"no simulations of subject {observed.subject} are given")
    simulated = read_simulations(shards[observed.subject])
    if len(simulated.theta) < wanted:
        raise ArtefactError(
            f"subject {observed.subject}: {len(simulated.theta)} simulations, {wanted} wanted; "
            "delete its shards and rerun"
        )
    rows = {f.name: getattr(simulated, f.name)[:wanted] for f in fields(simulated) if f.name != SHARED}
    return replace(simulated, **rows)
