"""What a flow learns from: simulations at the measured phases of each subject."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import xarray as xr

from swesbi import artefacts
from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.heart.prior_simulations import PriorSimulations
from swesbi.measurement.likelihood import SpeedModel, draw_speeds
from swesbi.measurement.settings import MeasurementSettings
from swesbi.measurement.speeds import WallPhases, wall_at_phases
from swesbi.parameters import NUISANCE_COLUMNS, THETA_COLUMNS, THETA_NAMES
from swesbi.prior import sample
from swesbi.recording.observation import Observation


@dataclass(frozen=True)
class SubjectSimulations:
    """n prior simulations of one subject at the p measured phases of its recording.

    Attributes:
        model: The subject's recording under the experiment's settings.
        theta: Parameters; shape (n, 3).
        physiology: Free nuisance parameters of the simulation; shape (n, k).
        wall: Active stiffness and shortening at the phases.
    """

    model: SpeedModel
    theta: FloatArray
    physiology: FloatArray
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
KIND: Final = artefacts.register("speed_pool", {"/": SCHEMA}, ("subject", "parameter", "nuisance"))


def pool_dataset(
    pairs: Sequence[tuple[Observation, PriorSimulations]], measurement: MeasurementSettings
) -> xr.Dataset:
    """Return every subject's simulations at its own phases; NaN at phases that were not measured.

    Raises:
        ValueError: The subjects have different numbers of phases or simulations.
    """
    shapes = {(len(observed.phase), len(simulated.theta)) for observed, simulated in pairs}
    if len(shapes) > 1:
        raise ValueError(f"subjects have different numbers of phases and simulations: {sorted(shapes)}")
    values = artefacts.stacked_values([_of_subject(*pair, measurement) for pair in pairs])["/"]
    subjects = [observed.subject for observed, _ in pairs]
    labels = {
        "subject": subjects,
        "parameter": list(THETA_NAMES),
        "nuisance": list(pairs[0][1].nuisance_names),
    }
    return artefacts.build_dataset(SCHEMA, values, labels)


def read_pool(path: Path) -> Mapping[str, StoredSubject]:
    """Read the pool by subject.

    Raises:
        ArtefactError: The file is no such pool.
    """
    dataset = artefacts.load(path, KIND)[0]
    subjects = [str(name) for name in dataset["subject"].to_numpy()]
    rows = artefacts.from_rows(StoredSubject, dataset, "subject")
    return dict(zip(subjects, rows, strict=True))


def of_subject(pool: Mapping[str, StoredSubject], model: SpeedModel, path: Path) -> SubjectSimulations:
    """Return the simulations of one recording's subject, the missing phases left out.

    Raises:
        ArtefactError: The pool lacks the subject.
    """
    subject = model.recording.subject
    if subject not in pool:
        raise artefacts.ArtefactError(f"{path}: holds no subject {subject!r}; it holds {', '.join(pool)}")
    row = pool[subject]
    stored = (row.active_stiffness_kpa, row.active_slope_kpa, row.shortening, row.shortening_slope)
    return SubjectSimulations(
        model, row.theta, row.physiology, WallPhases(*(values[:, row.measured] for values in stored))
    )


def _of_subject(
    observed: Observation, simulated: PriorSimulations, measurement: MeasurementSettings
) -> StoredSubject:
    wall = wall_at_phases(simulated, observed.phase, measurement.active_stiffness_map)
    for values in vars(wall).values():
        values[:, ~observed.measured] = np.nan
    return StoredSubject(
        observed.phase, observed.measured, simulated.theta, simulated.physiology, *vars(wall).values()
    )
