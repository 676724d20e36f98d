"""What a spline flow learns from: simulations at the measured phases of each subject."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import xarray as xr

from swesbi import artefacts
from swesbi.arrays import BoolArray, FloatArray
from swesbi.measurement.likelihood import SpeedModel, draw_speeds
from swesbi.measurement.settings import MeasurementSettings
from swesbi.measurement.speeds import ActivePhases, active_at_phases, predict_speeds
from swesbi.parameters import THETA_COLUMNS, THETA_NAMES
from swesbi.prior import draw_passive_scale
from swesbi.recording.observation import Observation
from swesbi.simulations import PriorSimulations


@dataclass(frozen=True)
class SubjectSimulations:
    """n prior simulations of one subject at the p measured phases of its recording.

    Attributes:
        model: The subject's recording and passive shape under the experiment's settings.
        theta: Parameters; shape (n, 3).
        active: Active stiffness at the phases and its slope; (n, p) each.
    """

    model: SpeedModel
    theta: FloatArray
    active: ActivePhases

    def rows(self, start: int, stop: int) -> SubjectSimulations:
        """Return the simulations from ``start`` to before ``stop``."""
        rows = slice(start, stop)
        active = ActivePhases(self.active.stiffness_kpa[rows], self.active.slope_kpa[rows])
        return SubjectSimulations(self.model, self.theta[rows], active)


def at_phases(simulations: PriorSimulations, model: SpeedModel) -> SubjectSimulations:
    """Take stored simulations at the measured phases of a recording."""
    active = active_at_phases(
        simulations.cycle_phase,
        simulations.active_stiffness_kpa,
        model.recording.phase,
        model.settings.measurement.active_stiffness_map,
    )
    return SubjectSimulations(model, simulations.theta, active)


def noisy_speeds(simulations: SubjectSimulations, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Draw a passive scale, noise and discrepancy for each simulation.

    Returns:
        phi of shape (n, 4), and the speeds in m/s of shape (n, p).
    """
    model, settings = simulations.model, simulations.model.settings
    scale = draw_passive_scale(len(simulations.theta), settings.prior, rng)
    predicted = predict_speeds(
        scale, simulations.active, model.shape, model.recording.phase, settings.density_kg_m3
    )
    speeds = draw_speeds(predicted, model.recording.relative_se, settings.discrepancy, rng)
    return np.column_stack([simulations.theta, scale]), speeds


@dataclass(frozen=True)
class PooledSubject:
    """One subject's part of the pool: n simulations at the p measured phases."""

    theta: FloatArray
    active: ActivePhases


@dataclass(frozen=True)
class StoredSubject:
    """The same as the pool stores it: n simulations at all P phases, NaN at those that were not measured."""

    phase: Annotated[
        FloatArray, artefacts.Variable("phase", "1", "phases of the recording, fraction of the cycle")
    ]
    measured: Annotated[BoolArray, artefacts.Variable("phase", "1", "1 measured, 0 missing")]
    theta: Annotated[FloatArray, artefacts.Variable("simulation parameter", THETA_COLUMNS, "prior draws")]
    active_stiffness_kpa: Annotated[
        FloatArray, artefacts.Variable("simulation phase", "kPa", "active stiffness at the measured phases")
    ]
    active_slope_kpa: Annotated[
        FloatArray, artefacts.Variable("simulation phase", "kPa", "its slope, per (unitless) cycle")
    ]


SCHEMA: Final = artefacts.schema_of(StoredSubject, along="subject")["/"]
KIND: Final = artefacts.register("speed_pool", {"/": SCHEMA}, ("subject", "parameter"))


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
    return artefacts.build_dataset(SCHEMA, values, {"subject": subjects, "parameter": list(THETA_NAMES)})


def read_pool(path: Path) -> Mapping[str, PooledSubject]:
    """Read the pool by subject, the missing phases left out.

    Raises:
        ArtefactError: The file is no such pool.
    """
    dataset = artefacts.load(path, KIND)[0]
    subjects = [str(name) for name in dataset["subject"].to_numpy()]
    rows = artefacts.from_rows(StoredSubject, dataset, "subject")
    return {name: _at_measured(row) for name, row in zip(subjects, rows, strict=True)}


def of_subject(pool: Mapping[str, PooledSubject], subject: str, path: Path) -> PooledSubject:
    """Return one subject's part of a pool.

    Raises:
        ArtefactError: The pool lacks the subject.
    """
    if subject not in pool:
        raise artefacts.ArtefactError(f"{path}: holds no subject {subject!r}; it holds {', '.join(pool)}")
    return pool[subject]


def _of_subject(
    observed: Observation, simulated: PriorSimulations, measurement: MeasurementSettings
) -> StoredSubject:
    active = active_at_phases(
        simulated.cycle_phase,
        simulated.active_stiffness_kpa,
        observed.phase,
        measurement.active_stiffness_map,
    )
    missing = ~observed.measured
    for values in (active.stiffness_kpa, active.slope_kpa):
        values[:, missing] = np.nan
    return StoredSubject(
        observed.phase, observed.measured, simulated.theta, active.stiffness_kpa, active.slope_kpa
    )


def _at_measured(row: StoredSubject) -> PooledSubject:
    stiffness, slope = row.active_stiffness_kpa, row.active_slope_kpa
    return PooledSubject(row.theta, ActivePhases(stiffness[:, row.measured], slope[:, row.measured]))
