"""One subject's observed stiffness curve, with everything that is known of how it was measured.

The contexts are a file of their own, so that comparing a subject with the cohort reads one file.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swesbi.artefacts import (
    Part,
    Variable,
    build_dataset,
    from_groups,
    from_rows,
    load,
    register,
    schema_of,
    stacked_values,
)
from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.context import Context
from swesbi.recording.cohort.clinical import NOT_MEASURED, ClinicalMeasures
from swesbi.recording.samples import REASONS
from swesbi.recording.speed import NoiseComponents

SUBJECTS: Final = {"subject": Variable("subject", "1", "subjects of the cohort")}
COHORT: Final = SUBJECTS | schema_of(Context, along="subject")["/"]
CONTEXTS: Final = register("contexts", {"/": COHORT})


Recorded = TypeVar("Recorded")


@dataclass(frozen=True)
class Observation:
    """The observed curve E_obs,d of one subject (paper, Eq. 1), P phases, G grid points.

    The phases are ascending in [0, 1), the grid runs over [0, 1] with both ends, the curve is through the
    measured phases alone; repeats are ascending. ``noise`` is that of this recording, ``clinical`` what was
    measured beside it.
    """

    context: Annotated[Context, Part(group="context")]
    phase: Annotated[
        FloatArray, Variable("phase", "1", "phase of the recording, fraction of the cycle from the R peak")
    ]
    phase_index: Annotated[IntArray, Variable("phase", "1", "index of the phase in the recording")]
    measured: Annotated[
        BoolArray, Variable("phase", "1", "1 where the phase was measured, 0 where it is missing")
    ]
    speed_m_s: Annotated[
        FloatArray, Variable("phase", "m s-1", "mean shear-wave speed c_s, NaN where missing")
    ]
    speed_se_m_s: Annotated[FloatArray, Variable("phase", "m s-1", "standard error of c_s")]
    stiffness_kpa: Annotated[FloatArray, Variable("phase", "kPa", "apparent Young's modulus 3 rho c_s^2")]
    stiffness_se_kpa: Annotated[FloatArray, Variable("phase", "kPa", "standard error of the stiffness")]
    grid: Annotated[FloatArray, Variable("grid", "1", "uniform analysis grid, fraction of the cycle")]
    curve_kpa: Annotated[FloatArray, Variable("grid", "kPa", "observed stiffness E_obs on the analysis grid")]
    samples_accepted: Annotated[IntArray, Variable("phase", "1", "accepted samples")]
    samples_by_repeat: Annotated[IntArray, Variable("phase repeat", "1", "accepted samples of each repeat")]
    samples_rejected: Annotated[IntArray, Variable("reason phase", "1", "rejected samples by reason")]
    noise: Annotated[NoiseComponents, Part()]
    clinical: Annotated[ClinicalMeasures, Part(group="clinical")] = NOT_MEASURED

    @property
    def reason(
        self,
    ) -> Annotated[
        tuple[str, ...], Variable("reason", "1", "reasons of rejection", after="samples_by_repeat")
    ]:
        """What the rows of ``samples_rejected`` are of."""
        return REASONS

    @property
    def subject(self) -> str:
        """The subject's name."""
        return self.context.subject

    @property
    def measured_phase(self) -> FloatArray:
        """The phases that were measured; shape (p,)."""
        return self.phase[self.measured]

    @property
    def rejected(self) -> dict[str, int]:
        """Number of rejected samples by reason, over all phases."""
        counts = self.samples_rejected.sum(axis=1)
        return {reason: int(count) for reason, count in zip(REASONS, counts, strict=True)}


KIND: Final = register("observation", schema_of(Observation))


def read_observation(path: Path) -> Observation:
    """Read the observed curve of one subject.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    return read_recorded(Observation, path, KIND)


def read_recorded(stored: type[Recorded], path: Path, kind: str) -> Recorded:
    """Read what a recording shows, with the context and the further measures of its subject.

    Args:
        stored: What it is kept as.
        path: The artefact.
        kind: Of which kind it is.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    root, provenance = load(path, kind)
    groups = {"/": root, **{name: load(path, kind, name)[0] for name in ("context", "clinical")}}
    return from_groups(stored, groups, {"context.subject": provenance.subject})


def contexts_dataset(contexts: Sequence[Context]) -> xr.Dataset:
    """Return the contexts of a cohort as an artefact's content; subjects in the order given."""
    names = np.array([context.subject for context in contexts])
    return build_dataset(COHORT, {"subject": names, **context_values(contexts)})


def read_contexts(path: Path) -> tuple[Context, ...]:
    """Read the contexts of a cohort.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    return contexts_of(load(path, CONTEXTS)[0], "subject")


def context_values(contexts: Sequence[Context]) -> dict[str, NDArray[np.generic]]:
    """Return the values of the contexts, an array of shape (n,) for each."""
    return stacked_values(contexts)["/"]


def contexts_of(dataset: xr.Dataset, along: str) -> tuple[Context, ...]:
    """Rebuild the contexts along a dimension, named by the labels ``subject``."""
    names = [str(name) for name in dataset["subject"].to_numpy()]
    return tuple(from_rows(Context, dataset, along, subject=names))


def same_recording(one: Observation, other: Observation) -> bool:
    """Tell whether two observed curves are of the same samples, heart and further measures."""
    if one.context != other.context or not one.clinical.same_as(other.clinical):
        return False
    names = ("phase", "phase_index", "speed_m_s", "speed_se_m_s", "samples_accepted", "samples_by_repeat")
    return same_arrays(one, other, names)


def same_arrays(one: object, other: object, names: Sequence[str]) -> bool:
    """Tell whether two recordings have the same numbers under these names."""
    pairs = [(getattr(one, name), getattr(other, name)) for name in names]
    return all(np.array_equal(mine, its, equal_nan=mine.dtype.kind == "f") for mine, its in pairs)
