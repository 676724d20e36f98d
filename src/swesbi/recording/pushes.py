"""From the pushes of a free-running recording to speeds at instants of the cycle, or the reason why not."""

from __future__ import annotations

from typing import Final

import numpy as np

from swesbi.context import Context
from swesbi.recording.cohort.clinical import NOT_MEASURED, ClinicalMeasures
from swesbi.recording.ingest import other_heart_rate, other_unit
from swesbi.recording.observation import Observation
from swesbi.recording.phases import cells_of
from swesbi.recording.problems import Problem, raise_any, refusal
from swesbi.recording.quality import push_quality
from swesbi.recording.samples import ACCEPTED, REASONS, Samples, sample_rejection
from swesbi.recording.settings import NoiseDeclaration, RecordingSettings
from swesbi.recording.speed import NoiseComponents, youngs_modulus_kpa
from swesbi.recording.tables.columns import TIME

LEAST_PUSHES: Final = 2
LATEST_IN_PERCENT: Final = 110.0  # few trains of pushes end so soon after the R peak
LATEST_IN_S: Final = 5.0  # of times in s, none is later: an RR interval has 5000 ms at most


def ingest_pushes(
    samples: Samples,
    context: Context,
    settings: RecordingSettings,
    declared: NoiseDeclaration,
    clinical: ClinicalMeasures = NOT_MEASURED,
) -> Observation:
    """Turn the pushes of a free-running recording into speeds at instants of the cycle.

    No two are averaged: each accepted one is a point that was measured. A cell of the cycle is one of
    ``settings.phases`` equal parts, within which the model has one error. A ``RecordingError`` says
    why it cannot be used.
    """
    _check_pushes(samples, context, settings)
    quality = push_quality(samples, settings, declared)
    phase, speed = samples.beat_phase, samples.speed_m_s
    beat = np.zeros_like(samples.repeat) if samples.beat is None else samples.beat
    # rows may come in any order, and several at one instant
    order = np.lexsort((speed, samples.time_ms, beat, samples.repeat, phase))
    measured, reason = (quality.verdict == ACCEPTED)[order], quality.verdict[order]
    relative = np.full(len(order), np.nan)
    relative[quality.verdict == ACCEPTED] = quality.noise.relative_se
    relative, speed = relative[order], np.where(measured, speed[order], np.nan)
    stiffness = youngs_modulus_kpa(speed, settings.density_kg_m3)
    numbered = np.stack([samples.repeat, beat])[:, quality.verdict == ACCEPTED]
    return Observation(
        context=context,
        phase=phase[order],
        phase_index=order,
        cell=cells_of(phase[order], settings.phases),
        measured=measured,
        speed_m_s=speed,
        speed_se_m_s=relative * speed,
        stiffness_kpa=stiffness,
        stiffness_se_kpa=2.0 * relative * stiffness,  # first order: dE / E = 2 dc / c
        samples_accepted=measured.astype(np.int64),
        samples_by_repeat=measured[:, None].astype(np.int64),
        samples_rejected=(reason == np.arange(len(REASONS))[:, None]).astype(np.int64),
        noise=NoiseComponents(np.nan, np.nan),
        errors_from=quality.noise.source,
        errors_log_sd=quality.noise.log_sd,
        beats=len(np.unique(numbered, axis=1).T),
        clinical=clinical,
    )


def _check_pushes(samples: Samples, context: Context, settings: RecordingSettings) -> None:
    """Refuse a recording of fewer than two pushes that are acceptable by themselves, or of another heart."""
    verdict = sample_rejection(samples, settings)
    accepted = verdict == ACCEPTED
    if accepted.sum() < LEAST_PUSHES:
        counts = [(reason, int((verdict == index).sum())) for index, reason in enumerate(REASONS)]
        told = ", ".join(f"{reason} {n}" for reason, n in counts if n)
        reason = f"{int(accepted.sum())} pushes are acceptable of {len(verdict)} ({told or 'no other'})"
        remedy = f"an answer needs {LEAST_PUSHES}: record again"
        if (verdict == REASONS.index("ectopic_rr")).sum() >= LEAST_PUSHES:
            reason += (
                f": no beat has an RR interval near the median, {samples.median_rr_ms:.0f} ms, as in bigeminy"
            )
            remedy = "keep the rows of one kind of beat, the long ones say, and give their hr_bpm"
        raise refusal(samples.source, reason, remedy)
    found = (
        other_heart_rate(samples, context, settings.max_rr_deviation_fraction),
        other_unit(samples.speed_m_s[accepted], samples.source),
        _other_unit_of_time(samples),
    )
    raise_any(problem for problem in found if problem)


def _other_unit_of_time(samples: Samples) -> Problem | None:
    """Return what is wrong where times must be in seconds, or may be in per cent and no unit is stated."""
    latest = float(np.max(samples.time_ms, initial=0.0))
    if LATEST_IN_S <= latest <= LATEST_IN_PERCENT and not samples.unit_of_time:
        return Problem(
            samples.source,
            f"the latest push is {latest:g} ms after its R peak: these can be per cent of the beat",
            f"if they are ms, say `units: {{ {TIME}: ms }}` in recording.yaml; if they are per cent, "
            "multiply them by rr_ms / 100",
            column=TIME,
        )
    if not 0.0 < latest < LATEST_IN_S:
        return None
    return Problem(
        samples.source,
        f"the latest push is {latest:g} ms after its R peak",
        f"check the unit: ms, or say `units: {{ {TIME}: s }}` in recording.yaml",
        column=TIME,
    )
