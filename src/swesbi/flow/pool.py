"""The training set as an artefact: simulations at the measured phases of every subject."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swesbi.artefacts import ArtefactError, build_dataset, load
from swesbi.artefacts.kinds.flow import SCHEMAS
from swesbi.observation.settings import MeasurementSettings
from swesbi.parameters import THETA_NAMES
from swesbi.recording.observation import Observation
from swesbi.simulations.draw import PriorSimulations
from swesbi.speed_model.prediction import ActivePhases, active_at_phases

FloatArray = NDArray[np.float64]
KIND: Final = "speed_pool"
SCHEMA: Final = SCHEMAS[KIND]["/"]


@dataclass(frozen=True)
class PooledSubject:
    """One subject's part of the pool: n simulations at the p measured phases."""

    theta: FloatArray
    active: ActivePhases


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
    arrays = [_of_subject(*part, measurement) for part in parts]
    values = {name: np.stack([array[name] for array in arrays]) for name in SCHEMA}
    subjects = [observed.subject for observed, _ in parts]
    return build_dataset(SCHEMA, values, {"subject": subjects, "parameter": list(THETA_NAMES)})


def read_pool(path: Path) -> Mapping[str, PooledSubject]:
    """Read the pool by subject, the missing phases left out.

    Raises:
        ArtefactError: The file is no such pool.
    """
    dataset = load(path, KIND)[0]
    subjects = [str(name) for name in dataset["subject"].to_numpy()]
    return {name: _subject(dataset, index) for index, name in enumerate(subjects)}


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
) -> dict[str, NDArray[np.generic]]:
    active = active_at_phases(
        simulated.cycle_phase,
        simulated.active_stiffness_kpa,
        observed.phase,
        measurement.active_stiffness_map,
    )
    missing = ~observed.measured
    for values in (active.stiffness_kpa, active.slope_kpa):
        values[:, missing] = np.nan
    return {
        "phase": observed.phase,
        "measured": observed.measured.astype(np.int8),
        "theta": simulated.theta,
        "active_stiffness_kpa": active.stiffness_kpa,
        "active_slope_kpa": active.slope_kpa,
    }


def _subject(dataset: xr.Dataset, index: int) -> PooledSubject:
    own = dataset.isel(subject=index)
    measured = own["measured"].to_numpy().astype(bool)
    stiffness, slope = (own[f"active_{name}_kpa"].to_numpy()[:, measured] for name in ("stiffness", "slope"))
    return PooledSubject(own["theta"].to_numpy(), ActivePhases(stiffness, slope))
