"""The training set as an artefact: simulations at the measured phases of every subject."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swesbi.artefacts import (
    ArtefactError,
    Variable,
    build_dataset,
    from_rows,
    load,
    register,
    schema_of,
    stacked_values,
)
from swesbi.observation.settings import MeasurementSettings
from swesbi.parameters import THETA_COLUMNS, THETA_NAMES
from swesbi.recording.observation import Observation
from swesbi.simulations.draw import PriorSimulations
from swesbi.speed_model.prediction import ActivePhases, active_at_phases

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class PooledSubject:
    """One subject's part of the pool: n simulations at the p measured phases."""

    theta: FloatArray
    active: ActivePhases


@dataclass(frozen=True)
class StoredSubject:
    """The same as the pool stores it: n simulations at all P phases, NaN at those that were not measured."""

    phase: Annotated[FloatArray, Variable("phase", "1", "phases of the recording, fraction of the cycle")]
    measured: Annotated[NDArray[np.bool_], Variable("phase", "1", "1 measured, 0 missing")]
    theta: Annotated[FloatArray, Variable("simulation parameter", THETA_COLUMNS, "prior draws")]
    active_stiffness_kpa: Annotated[
        FloatArray, Variable("simulation phase", "kPa", "active stiffness at the measured phases")
    ]
    active_slope_kpa: Annotated[
        FloatArray, Variable("simulation phase", "kPa", "its slope, per (unitless) cycle")
    ]


SCHEMA: Final = schema_of(StoredSubject, along="subject")["/"]
KIND: Final = register("speed_pool", {"/": SCHEMA}, ("subject", "parameter"))


def pool_dataset(
    parts: Sequence[tuple[Observation, PriorSimulations]], measurement: MeasurementSettings
) -> xr.Dataset:
    """Return every subject's simulations at its own phases; NaN at phases that were not measured.

    Raises:
        ValueError: The subjects have different numbers of phases or simulations.
    """
    shapes = {(len(observed.phase), len(simulated.theta)) for observed, simulated in parts}
    if len(shapes) > 1:
        raise ValueError(f"subjects have different numbers of phases and simulations: {sorted(shapes)}")
    values = stacked_values([_of_subject(*part, measurement) for part in parts])["/"]
    subjects = [observed.subject for observed, _ in parts]
    return build_dataset(SCHEMA, values, {"subject": subjects, "parameter": list(THETA_NAMES)})


def read_pool(path: Path) -> Mapping[str, PooledSubject]:
    """Read the pool by subject, the missing phases left out.

    Raises:
        ArtefactError: The file is no such pool.
    """
    dataset = load(path, KIND)[0]
    subjects = [str(name) for name in dataset["subject"].to_numpy()]
    rows = from_rows(StoredSubject, dataset, "subject")
    return {name: _at_measured(row) for name, row in zip(subjects, rows, strict=True)}


def of_subject(pool: Mapping[str, PooledSubject], subject: str, path: Path) -> PooledSubject:
    """Return one subject's part of a pool.

    Raises:
        ArtefactError: The pool lacks the subject.
    """
    if subject not in pool:
        raise ArtefactError(f"{path}: holds no subject {subject!r}; it holds {', '.join(pool)}")
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
