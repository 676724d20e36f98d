"""What a free-running recording shows: a speed at each instant of the cycle at which a push was accepted."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import numpy as np

from swesbi.artefacts import Part, Variable, register, schema_of
from swesbi.base.arrays import FloatArray, IntArray
from swesbi.context import Context
from swesbi.recording.cohort.clinical import NOT_MEASURED, ClinicalMeasures
from swesbi.recording.free_noise import NoiseSource
from swesbi.recording.free_quality import push_quality
from swesbi.recording.free_samples import FreeSamples, free_rejection
from swesbi.recording.ingest import other_heart_rate, other_unit
from swesbi.recording.observation import read_recorded, same_arrays
from swesbi.recording.problems import Problem, RecordingError, raise_any
from swesbi.recording.samples import ACCEPTED, REASONS
from swesbi.recording.settings import NoiseDeclaration, RecordingSettings
from swesbi.recording.speed import youngs_modulus_kpa
from swesbi.recording.tables.columns import TIME

LEAST_PUSHES: Final = 2
LATEST_IN_PERCENT: Final = 110.0  # few trains of pushes end so soon after the R peak
LATEST_IN_S: Final = 5.0  # of times in s, none is later: an RR interval has 5000 ms at most


@dataclass(frozen=True)
class FreeObservation:
    """The accepted pushes of one subject, in the order of their instants; p rows.

    The model's error is one for all pushes of a cell of the cycle (``measurement.instants``). ``clinical`` is
    what was measured beside the speeds.
    """

    context: Annotated[Context, Part(group="context")]
    phase: Annotated[
        FloatArray,
        Variable("push", "1", "instant of the push, fraction of its own beat from the R peak"),
    ]
    time_ms: Annotated[FloatArray, Variable("push", "ms", "time of the push since the R peak of its beat")]
    rr_ms: Annotated[FloatArray, Variable("push", "ms", "RR interval of that beat")]
    beat: Annotated[IntArray, Variable("push", "1", "number of the beat, 0 where the file has none")]
    repeat: Annotated[IntArray, Variable("push", "1", "number of the train, 0 where the file has none")]
    cell: Annotated[IntArray, Variable("push", "1", "cell of the cycle in which the model has one error")]
    speed_m_s: Annotated[FloatArray, Variable("push", "m s-1", "shear-wave speed c_s")]
    relative_se: Annotated[
        FloatArray, Variable("push", "1", "standard error over speed; its prior median where declared")
    ]
    stiffness_kpa: Annotated[FloatArray, Variable("push", "kPa", "apparent Young's modulus 3 rho c_s^2")]
    noise_source: Annotated[
        NoiseSource, Variable("", "1", "what the errors are estimated from: se_m_s, fit_r2 or declared")
    ]
    noise_log_sd: Annotated[
        float, Variable("", "1", "prior sd of the log of a factor of all errors, 0 where they are known")
    ]
    samples_rejected: Annotated[IntArray, Variable("reason", "1", "rejected pushes by reason")]
    clinical: Annotated[ClinicalMeasures, Part(group="clinical")] = NOT_MEASURED

    @property
    def reason(
        self,
    ) -> Annotated[
        tuple[str, ...], Variable("reason", "1", "reasons of rejection", after="samples_rejected")
    ]:
        """What the rows of ``samples_rejected`` are of."""
        return REASONS

    @property
    def subject(self) -> str:
        """The subject's name."""
        return self.context.subject

    @property
    def beats(self) -> int:
        """In how many beats the pushes lie, as far as the file numbers them."""
        return len(np.unique(np.stack([self.repeat, self.beat]), axis=1).T)

    @property
    def rejected(self) -> dict[str, int]:
        """Number of rejected pushes by reason."""
        return dict(zip(REASONS, map(int, self.samples_rejected), strict=True))


def ingest_free(
    samples: FreeSamples,
    context: Context,
    settings: RecordingSettings,
    declared: NoiseDeclaration,
    clinical: ClinicalMeasures = NOT_MEASURED,
) -> FreeObservation:
    """Turn the pushes of a free-running recording into speeds at instants of the cycle.

    No two are averaged. A cell of the cycle is one of ``settings.phases`` equal parts, within which the model
    has one error.

    Args:
        samples: The recording.
        context: The subject's context.
        settings: Quality limits, density, number of cells.
        declared: What is said of its errors.
        clinical: What was measured beside the speeds.

    Raises:
        RecordingError: Fewer than two pushes are accepted, it cannot be of this context, nothing tells its
            errors, or too many pushes lie far outside their neighbours.
    """
    _check_pushes(samples, context, settings)
    quality = push_quality(samples, settings, declared)
    accepted, noise = quality.verdict == ACCEPTED, quality.noise
    cell = np.minimum((samples.phase * settings.phases).astype(np.int64), settings.phases - 1)
    # rows may come in any order, and several at one instant
    keys = (samples.speed_m_s, samples.time_ms, samples.beat, samples.repeat, samples.phase)
    order = np.lexsort([key[accepted] for key in keys])
    chosen = np.flatnonzero(accepted)[order]
    return FreeObservation(
        context=context,
        phase=samples.phase[chosen],
        time_ms=samples.time_ms[chosen],
        rr_ms=samples.rr_ms[chosen],
        beat=samples.beat[chosen],
        repeat=samples.repeat[chosen],
        cell=cell[chosen],
        speed_m_s=samples.speed_m_s[chosen],
        relative_se=noise.relative_se[order],
        stiffness_kpa=youngs_modulus_kpa(samples.speed_m_s[chosen], settings.density_kg_m3),
        noise_source=noise.source,
        noise_log_sd=noise.log_sd,
        samples_rejected=_counts(quality.verdict),
        clinical=clinical,
    )


def _counts(verdict: IntArray) -> IntArray:
    return np.bincount(verdict + 1, minlength=len(REASONS) + 1)[1:]


def _check_pushes(samples: FreeSamples, context: Context, settings: RecordingSettings) -> None:
    """Refuse a recording of fewer than two pushes that are acceptable by themselves, or of another heart."""
    verdict = free_rejection(samples, settings)
    accepted = verdict == ACCEPTED
    if accepted.sum() < LEAST_PUSHES:
        counted = zip(REASONS, _counts(verdict), strict=True)
        told = ", ".join(f"{reason} {n}" for reason, n in counted if n)
        reason = f"{int(accepted.sum())} pushes are acceptable of {len(verdict)} ({told or 'no other'})"
        remedy = f"an answer needs {LEAST_PUSHES}: record again"
        if (verdict == REASONS.index("ectopic_rr")).sum() >= LEAST_PUSHES:
            median = float(np.median(samples.beats_rr_ms()))
            reason += f": no beat has an RR interval near the median, {median:.0f} ms, as in bigeminy"
            remedy = "keep the rows of one kind of beat, the long ones say, and give their hr_bpm"
        raise RecordingError(Problem(samples.source, reason, remedy))
    _check_plausible(samples, samples.speed_m_s[accepted], context, settings)


def _check_plausible(
    samples: FreeSamples, speed_m_s: FloatArray, context: Context, settings: RecordingSettings
) -> None:
    median, limit = float(np.median(samples.beats_rr_ms())), settings.max_rr_deviation_fraction
    found = (
        other_heart_rate(median, context, limit, samples.source),
        other_unit(speed_m_s, samples.source),
        _other_unit_of_time(samples),
    )
    raise_any(problem for problem in found if problem)


def _other_unit_of_time(samples: FreeSamples) -> Problem | None:
    """Return what is wrong where times must be in seconds, or may be in per cent and no unit is stated."""
    latest = float(np.max(samples.time_ms, initial=0.0))
    if LATEST_IN_S <= latest <= LATEST_IN_PERCENT and not samples.unit_of_time:
        reason = f"the latest push is {latest:g} ms after its R peak: these can be per cent of the beat"
        remedy = (
            f"if they are ms, say `units: {{ {TIME}: ms }}` in recording.yaml; if they are per cent, "
            "multiply them by rr_ms / 100"
        )
        return Problem(samples.source, reason, remedy, column=TIME)
    if not 0.0 < latest < LATEST_IN_S:
        return None
    reason = f"the latest push is {latest:g} ms after its R peak"
    remedy = f"check the unit: ms, or say `units: {{ {TIME}: s }}` in recording.yaml"
    return Problem(samples.source, reason, remedy, column=TIME)


KIND: Final = register("free_observation", schema_of(FreeObservation))


def read_free_observation(path: Path) -> FreeObservation:
    """Read what a free-running recording shows.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    return read_recorded(FreeObservation, path, KIND)


def same_free_recording(one: FreeObservation, other: FreeObservation) -> bool:
    """Tell whether two are of the same pushes, heart, errors and further measures."""
    same = (one.context, one.noise_source, one.noise_log_sd)
    if same != (other.context, other.noise_source, other.noise_log_sd):
        return False
    if not one.clinical.same_as(other.clinical):
        return False
    names = ("time_ms", "rr_ms", "beat", "repeat", "speed_m_s", "relative_se")
    return same_arrays(one, other, names)
