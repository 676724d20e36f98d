"""The study of identifiability as an artefact."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swesbi.artefacts import build_dataset
from swesbi.artefacts.kinds.identifiability import SCHEMAS
from swesbi.identifiability.cohort import CohortIdentifiability
from swesbi.identifiability.quantities import QUANTITY_NAMES
from swesbi.identifiability.settings import IdentifiabilitySettings
from swesbi.identifiability.subject import RecordedSubject, SubjectIdentifiability
from swesbi.parameters import PHI_NAMES

FloatArray = NDArray[np.float64]
KIND: Final = "identifiability"
SCHEMA: Final = SCHEMAS[KIND]


def to_groups(found: CohortIdentifiability, settings: IdentifiabilitySettings) -> dict[str, xr.Dataset]:
    """Return the groups of ``identifiability.h5``."""
    values = {
        "/": _root(found, settings),
        "profile": _profiles(found, settings),
        "phases": _phases(found),
        "design": _designs(found),
        "placement": {name: getattr(found.placement, name) for name in ("phase", "sd_log", "sd_log_even")},
    }
    labels = {
        "subject": [one.subject for one in found.subjects],
        "quantity": list(QUANTITY_NAMES),
        "parameter": list(PHI_NAMES),
        "bound": ["lower", "upper"],
        "phases": list(settings.design.phases),
        "repeats": list(settings.design.repeats),
        "placed": list(found.placement.counts),
    }
    return {group: _labelled(group, values[group], labels) for group in SCHEMA}


def _labelled(group: str, values: Mapping[str, Any], labels: Mapping[str, Any]) -> xr.Dataset:
    dataset = build_dataset(SCHEMA[group], values)
    return dataset.assign_coords({name: label for name, label in labels.items() if name in dataset.dims})


def _stacked(
    found: CohortIdentifiability, part: Callable[[SubjectIdentifiability], object], names: tuple[str, ...]
) -> dict[str, FloatArray]:
    """Return attributes of one part of every subject's result, subjects first."""
    return {name: np.stack([getattr(part(one), name) for one in found.subjects]) for name in names}


def _root(found: CohortIdentifiability, settings: IdentifiabilitySettings) -> dict[str, Any]:
    spread = ("median", "sd_log", "expected_sd_log", "expected_sd_log_at_median")
    return {
        **_stacked(found, lambda one: one.spread, spread),
        "contraction": np.stack([one.contraction.linear for one in found.subjects]),
        "contraction_log": np.stack([one.contraction.logarithm for one in found.subjects]),
        "interval_mass": settings.interval,
        "shown_phi": _equal_rows([one.shown for one in found.subjects]),
    }


def _equal_rows(draws: list[FloatArray]) -> FloatArray:
    """Stack draws (m_i, 4), cut to the fewest of any subject."""
    fewest = min(map(len, draws))
    return np.stack([one[:fewest] for one in draws])


def _profiles(found: CohortIdentifiability, settings: IdentifiabilitySettings) -> dict[str, Any]:
    own = {"activation_duration_s", "closed", "confidence_level"}
    names = tuple(name for name in SCHEMA["profile"] if name not in own)
    closed = np.stack([one.profiles.closed for one in found.subjects]).astype(np.int8)
    return {
        **_stacked(found, lambda one: one.profiles, names),
        "activation_duration_s": np.array([one.duration_s for one in found.recorded]),
        "closed": closed,
        "confidence_level": list(settings.profile.confidence_levels),
    }


def _phases(found: CohortIdentifiability) -> dict[str, Any]:
    pairs = list(zip(found.recorded, found.subjects, strict=True))
    return {
        "phase_of": np.stack([one.phase for one in found.recorded]),
        "measured": np.stack([one.measured for one in found.recorded]).astype(np.int8),
        "share": np.stack([_with_missing(r, s.phases.share) for r, s in pairs]),
        "expected_sd_increase": np.stack([_with_missing(r, s.phases.sd_increase) for r, s in pairs]),
        "left_out_sd_increase": np.stack([_with_missing(r, s.left_out.sd_increase) for r, s in pairs]),
        "left_out_mean_shift": np.stack([_with_missing(r, s.left_out.mean_shift) for r, s in pairs]),
        "k_hat": np.stack([_with_missing(r, s.left_out.k_hat) for r, s in pairs]),
    }


def _with_missing(recorded: RecordedSubject, values: FloatArray) -> FloatArray:
    """Spread values (..., p) of the measured phases over all phases (..., P), NaN where missing."""
    spread = np.full((*values.shape[:-1], len(recorded.measured)), np.nan)
    spread[..., recorded.measured] = values
    return spread


def _designs(found: CohortIdentifiability) -> dict[str, Any]:
    names = ("sd_log", "sd_log_independent", "floor", "floor_independent")
    return {
        **_stacked(found, lambda one: one.designs, names),
        "repeat_se": np.sqrt([one.repeat_variance for one in found.recorded]),
        "own_repeats": np.array([one.equivalent_repeats for one in found.recorded]),
        "own_phases": np.array([int(one.measured.sum()) for one in found.recorded]),
    }
