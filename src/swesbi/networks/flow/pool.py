"""What a flow learns from: simulations at the measured phases of each subject."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from swesbi import artefacts
from swesbi.artefacts.schema import Schema
from swesbi.artefacts.typed import BySubject
from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.base.progress import LOGGER
from swesbi.heart.prior_simulations import PriorSimulations, first_of
from swesbi.measurement.likelihood import SpeedModel, draw_speeds
from swesbi.measurement.settings import MeasurementSettings
from swesbi.measurement.speeds import WallPhases, wall_at_phases
from swesbi.parameters import NUISANCE_COLUMNS, THETA_COLUMNS, THETA_NAMES
from swesbi.prior import sample
from swesbi.recording.observation import Observation


@dataclass(frozen=True)
class SubjectSimulations:
    """n prior simulations of one subject at the p measured phases of its recording."""

    model: SpeedModel
    theta: FloatArray  # (n, 3)
    physiology: FloatArray  # free nuisance parameters of the simulation, (n, k)
    wall: WallPhases

    def rows(self, start: int, stop: int) -> SubjectSimulations:
        """Return the simulations from ``start`` to before ``stop``."""
        rows = slice(start, stop)
        return SubjectSimulations(self.model, self.theta[rows], self.physiology[rows], self.wall.rows(rows))


def at_phases(simulations: PriorSimulations, model: SpeedModel) -> SubjectSimulations:
    """Take stored simulations at the measured phases of a recording."""
    return SubjectSimulations(
        model, simulations.theta, simulations.physiology, model.wall_at_phases(simulations)
    )


def noisy_speeds(simulations: SubjectSimulations, rng: np.random.Generator) -> FloatArray:
    """Draw what the measurement takes, noise and discrepancy for each simulation: speeds in m/s, (n, p)."""
    model, settings = simulations.model, simulations.model.settings
    operator = sample(len(simulations.theta), settings.prior.operator, rng)
    phi = settings.prior.joined(simulations.theta, simulations.physiology, operator)
    predicted = model.predict_at(phi, simulations.wall)
    return draw_speeds(predicted, model.recording.errors, settings.discrepancy, rng)


@dataclass(frozen=True)
class StoredSubject:
    """One subject's part of the pool: n simulations at all P phases, NaN at those that were not measured."""

    phase: Annotated[
        FloatArray, artefacts.Variable("phase", "1", "phases of the recording, fraction of the cycle")
    ]
    measured: Annotated[BoolArray, artefacts.Variable("phase", "1", "1 measured, 0 missing")]
    theta: Annotated[FloatArray, artefacts.Variable("simulation parameter", THETA_COLUMNS, "prior draws")]
    physiology: Annotated[
        FloatArray,
        artefacts.Variable("simulation nuisance", NUISANCE_COLUMNS, "free physiology of the simulation"),
    ]
    active_stiffness_kpa: Annotated[
        FloatArray, artefacts.Variable("simulation phase", "kPa", "active stiffness at the measured phases")
    ]
    active_slope_kpa: Annotated[
        FloatArray, artefacts.Variable("simulation phase", "kPa", "its slope, per (unitless) cycle")
    ]
    shortening: Annotated[
        FloatArray, artefacts.Variable("simulation phase", "1", "shortening of the wall, 0 to 1")
    ]
    shortening_slope: Annotated[
        FloatArray, artefacts.Variable("simulation phase", "1", "its slope, per (unitless) cycle")
    ]


SCHEMA: Final = artefacts.schema_of(StoredSubject, along="subject")["/"]


@dataclass(frozen=True)
class SpeedPool(artefacts.Artefact, kind="speed_pool"):
    """The simulations of every subject at the phases of its own recording; names of the free physiology."""

    of_subjects: Mapping[str, StoredSubject]
    nuisance_names: tuple[str, ...]

    @classmethod
    def schema(cls) -> Schema:
        """Return the one group of the file."""
        return {"/": SCHEMA}

    @classmethod
    def required_labels(cls) -> tuple[artefacts.Labels, ...]:
        """Return the names of subjects and parameters."""
        return tuple(map(artefacts.Labels, ("subject", "parameter", "nuisance")))

    def to_groups(self) -> dict[str, artefacts.Group]:
        """Return the content of the file."""
        values = artefacts.stacked_values(list(self.of_subjects.values()))["/"]
        labels = {
            "subject": list(self.of_subjects),
            "parameter": list(THETA_NAMES),
            "nuisance": list(self.nuisance_names),
        }
        return {"/": artefacts.build_group(SCHEMA, values, labels)}

    @classmethod
    def rebuilt(cls, groups: Mapping[str, artefacts.Group], made: artefacts.Provenance) -> SpeedPool:
        """Return what the group of a file holds."""
        names = {label: tuple(map(str, groups["/"][label].to_numpy())) for label in ("subject", "nuisance")}
        rows = artefacts.from_rows(StoredSubject, groups["/"], "subject")
        return cls(dict(zip(names["subject"], rows, strict=True)), names["nuisance"])

    def of(self, model: SpeedModel) -> SubjectSimulations:
        """Return the simulations of one recording's subject, the missing phases left out."""
        subject = model.recording.subject
        if subject not in self.of_subjects:
            raise artefacts.UnfitError(
                "pool", f"holds no subject {subject!r}; it holds {', '.join(self.of_subjects)}"
            )
        row = self.of_subjects[subject]
        stored = (row.active_stiffness_kpa, row.active_slope_kpa, row.shortening, row.shortening_slope)
        return SubjectSimulations(
            model, row.theta, row.physiology, WallPhases(*(values[:, row.measured] for values in stored))
        )


def pool_of_speeds(
    observations: tuple[Observation, ...],
    shards: BySubject[PriorSimulations],
    *,
    simulations_per_subject: int,
    measurement: MeasurementSettings,
) -> SpeedPool:
    """Take the first simulations of every subject at the phases of its recording; NaN at those not measured.

    Raises:
        UnfitError: A subject has no simulations, or too few, or other phases than the first.
    """
    taken: dict[str, StoredSubject] = {}
    names: tuple[str, ...] = ()
    phases = len(observations[0].phase)
    for observed in observations:
        if (own := len(observed.phase)) != phases:
            raise artefacts.UnfitError(
                "observations", f"subject {observed.subject} has {own} phases, not {phases}"
            )
        simulated = first_of(shards, observed.subject, simulations_per_subject)
        taken[observed.subject] = _of_subject(observed, simulated, measurement)
        names = simulated.nuisance_names
    LOGGER.info("%d subjects, %d simulations each", len(taken), simulations_per_subject)
    return SpeedPool(taken, names)


def _of_subject(
    observed: Observation, simulated: PriorSimulations, measurement: MeasurementSettings
) -> StoredSubject:
    wall = wall_at_phases(simulated, observed.phase, measurement.active_stiffness_map)
    for values in vars(wall).values():
        values[:, ~observed.measured] = np.nan
    return StoredSubject(
        observed.phase, observed.measured, simulated.theta, simulated.physiology, *vars(wall).values()
    )
