"""One subject's observed stiffness curve, with everything that is known of how it was measured.

The contexts are a file of their own, so that comparing a subject with the cohort reads one file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Final, Literal

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import (
    Artefact,
    Group,
    Part,
    Provenance,
    Variable,
    build_group,
    from_groups,
    from_rows,
    schema_of,
    stacked_values,
)
from swesbi.artefacts.schema import Schema
from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.context import Context
from swesbi.recording.cohort.clinical import NOT_MEASURED, ClinicalMeasures
from swesbi.recording.phases import analysis_grid, to_grid
from swesbi.recording.samples import REASONS
from swesbi.recording.speed import NoiseComponents

COHORT: Final = {
    "subject": Variable("subject", "1", "subjects of the cohort"),
    **schema_of(Context, along="subject")["/"],
}
ErrorSource = Literal["repeats", "se_m_s", "fit_r2", "declared"]
SOURCES: Final[dict[str, str]] = {
    "repeats": "standard errors by the repeats",
    "se_m_s": "standard errors of the file",
    "fit_r2": "standard errors by the R2 of the fits",
    "declared": "standard errors as stated, their size uncertain",
}


@dataclass(frozen=True)
class Observation(Artefact, kind="observation"):
    """What a recording shows at points of the cycle: gated phases (paper, Eq. 1), or single pushes.

    Points, P of them, are ascending in [0, 1). A gated phase whose samples failed and a push that was
    rejected are points that were not measured. Repeats are ascending; a push has one. ``noise`` is that of a
    gated recording's own repeats, NaN of pushes, ``clinical`` what was measured beside it.
    """

    context: Annotated[Context, Part(group="context")]
    phase: Annotated[FloatArray, Variable("phase", "1", "phase, fraction of the cycle from the R peak")]
    phase_index: Annotated[
        IntArray, Variable("phase", "1", "index of the gated phase, or of the push, in the recording")
    ]
    cell: Annotated[IntArray, Variable("phase", "1", "cell of the cycle in which the model has one error")]
    measured: Annotated[BoolArray, Variable("phase", "1", "1 where it was measured, 0 where it is missing")]
    speed_m_s: Annotated[FloatArray, Variable("phase", "m s-1", "shear-wave speed c_s, NaN where missing")]
    speed_se_m_s: Annotated[
        FloatArray, Variable("phase", "m s-1", "standard error of c_s; its prior median where declared")
    ]
    stiffness_kpa: Annotated[FloatArray, Variable("phase", "kPa", "apparent Young's modulus 3 rho c_s^2")]
    stiffness_se_kpa: Annotated[FloatArray, Variable("phase", "kPa", "standard error of the stiffness")]
    samples_accepted: Annotated[IntArray, Variable("phase", "1", "accepted samples")]
    samples_by_repeat: Annotated[IntArray, Variable("phase repeat", "1", "accepted samples of each repeat")]
    samples_rejected: Annotated[IntArray, Variable("reason phase", "1", "rejected samples by reason")]
    noise: Annotated[NoiseComponents, Part()]
    errors_from: Annotated[
        ErrorSource, Variable("", "1", "what errors are estimated from: repeats, se_m_s, fit_r2 or declared")
    ] = "repeats"
    errors_log_sd: Annotated[
        float, Variable("", "1", "prior sd of the log of a factor of all errors, 0 where they are known")
    ] = 0.0
    beats: Annotated[int, Variable("", "1", "numbered beats in which pushes lie; 0 of gated phases")] = 0
    grid_points: Annotated[int, Variable("", "1", "points of the analysis grid over [0, 1]")] = 100
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
    def is_gated(self) -> bool:
        """Whether the points are gated phases, whose errors are estimated from repeats."""
        return self.errors_from == "repeats"

    @classmethod
    def rebuilt(cls, groups: Mapping[str, Group], made: Provenance) -> Observation:
        """Return what the groups of a file hold, whose provenance names the subject."""
        return from_groups(cls, groups, {"context.subject": made.subject})

    @property
    def subject(self) -> str:
        """The subject's name."""
        return self.context.subject

    @property
    def grid(self) -> FloatArray:
        """The uniform analysis grid, both ends included; shape (G,)."""
        return analysis_grid(self.grid_points)

    @property
    def curve_kpa(self) -> FloatArray:
        """The observed curve E_obs,d of gated phases, through those that were measured; shape (G,)."""
        return to_grid(self.measured_phase, self.stiffness_kpa[self.measured], self.grid_points)

    @property
    def measured_phase(self) -> FloatArray:
        """The phases that were measured; shape (p,)."""
        return self.phase[self.measured]

    @property
    def relative_se(self) -> FloatArray:
        """Standard error of each measured speed as a fraction of it; shape (p,)."""
        return (self.speed_se_m_s / self.speed_m_s)[self.measured]

    @property
    def rejected(self) -> dict[str, int]:
        """Number of rejected samples by reason, over all phases."""
        counts = self.samples_rejected.sum(axis=1)
        return {reason: int(count) for reason, count in zip(REASONS, counts, strict=True)}


@dataclass(frozen=True)
class Contexts(Artefact, kind="contexts"):
    """The contexts of a cohort, in the order of its subjects."""

    of: tuple[Context, ...]

    @classmethod
    def schema(cls) -> Schema:
        """Return the one group of the file."""
        return {"/": COHORT}

    def to_groups(self) -> dict[str, Group]:
        """Return the content of the file."""
        names = np.array([context.subject for context in self.of])
        return {"/": build_group(COHORT, {"subject": names, **context_values(self.of)})}

    @classmethod
    def rebuilt(cls, groups: Mapping[str, Group], made: Provenance) -> Contexts:
        """Return what the group of a file holds."""
        return cls(contexts_of(groups["/"], "subject"))


def context_values(contexts: Sequence[Context]) -> dict[str, NDArray[np.generic]]:
    """Return the values of the contexts, an array of shape (n,) for each."""
    return stacked_values(contexts)["/"]


def contexts_of(dataset: Group, along: str) -> tuple[Context, ...]:
    """Rebuild the contexts along a dimension, named by the labels ``subject``."""
    names = [str(name) for name in dataset["subject"].to_numpy()]
    return tuple(from_rows(Context, dataset, along, subject=names))


def same_recording(one: Observation, other: Observation) -> bool:
    """Tell whether two are of the same samples, heart, errors and further measures."""
    said, its = ((each.context, each.errors_from, each.errors_log_sd) for each in (one, other))
    if said != its or not one.clinical.same_as(other.clinical):
        return False
    names = ("phase", "phase_index", "speed_m_s", "speed_se_m_s", "samples_accepted", "samples_by_repeat")
    pairs = [(getattr(one, name), getattr(other, name)) for name in names]
    return all(np.array_equal(first, second, equal_nan=first.dtype.kind == "f") for first, second in pairs)
