"""From raw samples to the observed curve of gates, or to the instants of pushes, or the reason why not."""

from __future__ import annotations

from typing import Final

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.context import Context
from swesbi.recording.cohort.clinical import NOT_MEASURED, ClinicalMeasures
from swesbi.recording.observation import Observation
from swesbi.recording.phases import cells_of, locate_phases
from swesbi.recording.problems import Problem, raise_any, refusal
from swesbi.recording.quality import push_quality, rejection
from swesbi.recording.samples import (
    ACCEPTED,
    REASONS,
    Samples,
    count_by_phase,
    count_by_repeat,
    ectopic,
    sample_rejection,
)
from swesbi.recording.settings import NoiseDeclaration, RecordingSettings
from swesbi.recording.speed import NoiseComponents, average_speeds, youngs_modulus_kpa
from swesbi.recording.tables.layout import SPEED, TIME

ROUNDING: Final = 1e-9
# Beats differ in length, so neighbouring phases lie a little nearer or farther than the protocol puts them.
BEAT_VARIATION: Final = 0.01
# Half the time the myocardium is near its diastolic 0.9-1.5 m/s in health, and up to several times that in
# the stiffest disease (Song et al. 2016, Santos et al. 2019); a wrong unit is off by ten at least.
MEDIAN_SPEED_RANGE_M_S: Final = (0.5, 10.0)
# Late diastole must have been measured, so the last push comes late in its beat.
LEAST_REACH: Final = 0.5
LEAST_PUSHES: Final = 2
LATEST_IN_PERCENT: Final = 110.0  # few trains of pushes end so soon after the R peak
LATEST_IN_S: Final = 5.0  # of times in s, none is later: an RR interval has 5000 ms at most


def incomplete(
    phase: FloatArray, measured: BoolArray, settings: RecordingSettings, source: str
) -> tuple[Problem, ...]:
    """Return in what a recording is incomplete: missing phases, too long a gap, too little late diastole.

    Phases (P,) are ascending; at least one is measured (P,).
    """
    missing = ", ".join(f"{value:.3f}" for value in phase[~measured])
    advice = f"missing phases: {missing or 'none'}; record them again or leave the subject out"
    fraction, most = float(np.mean(~measured)), settings.max_missing_fraction
    there = phase[measured]
    steps = np.diff(there, append=there[0] + 1.0)
    longest, limit = int(np.argmax(steps)), settings.max_gap_fraction
    (low, high), least = settings.late_diastolic_window, settings.min_late_diastolic_phases
    late = int(np.count_nonzero((there >= low) & (there <= high)))
    reasons = (
        (
            fraction > most + ROUNDING,
            f"{fraction:.0%} of the phases are missing, limit {most:.0%} ({len(there)} of the "
            f"{len(measured)} were measured)",
        ),
        (
            steps[longest] > limit + BEAT_VARIATION,
            f"no phase was measured for {steps[longest]:.3f} of the cycle after {there[longest]:.3f}, "
            f"limit {limit:g}",
        ),
        (
            late < least,
            f"{late} phases were measured in late diastole, [{low:g}, {high:g}] of the cycle, but the "
            f"passive baseline needs {least}",
        ),
    )
    return tuple(Problem(source, reason, advice) for refused, reason in reasons if refused)


def _advice(samples: Samples, settings: RecordingSettings) -> str:
    """Return what to do about a recording of which nothing is accepted, by the rule that cannot be met."""
    counts = count_by_repeat(samples, np.ones(samples.repeat.shape, dtype=np.bool_), settings.phases)
    most, needed = int((counts > 0).sum(axis=1).max()), settings.min_repeats_per_phase
    largest, least = int(counts.sum(axis=1).max()), settings.min_samples_per_phase
    if most >= needed and largest >= least:
        return "record again"
    if most >= needed:
        return (
            f"a phase needs {least} samples (recording.min_samples_per_phase), and none has more than "
            f"{largest}: "
            "give every sample of a repeat, or lower it in an overlay"
        )
    return (
        f"a phase needs {needed} repeats (recording.min_repeats_per_phase), by which errors are told, and "
        f"none has more than {most}: record each phase again, or number in `repeat` those that there are"
    )


def implausible(
    samples: Samples, accepted: BoolArray, context: Context, settings: RecordingSettings
) -> tuple[Problem, ...]:
    """Return what cannot be true of a recording: its heart rate, its delays, its accepted speeds."""
    problems = (
        other_heart_rate(samples, context, settings.max_rr_deviation_fraction),
        _delays(samples),
        other_unit(samples.speed_m_s[accepted], samples.source),
    )
    return tuple(problem for problem in problems if problem)


def other_heart_rate(samples: Samples, context: Context, limit: float) -> Problem | None:
    """Return what is wrong where a recording's median RR interval (ms) is too far from its context's."""
    median, expected = samples.median_rr_ms, 1e3 * context.period_s
    if abs(median / expected - 1.0) <= limit:
        return None
    return Problem(
        samples.source,
        f"the median RR interval is {median:.0f} ms ({6e4 / median:.0f} beats per minute), but hr_bpm of "
        f"{context.subject} in subjects.csv is {context.hr_bpm:g} ({expected:.0f} ms), limit {limit:.0%}",
        "give the heart rate of this recording",
        column="rr_ms",
    )


def _delays(samples: Samples) -> Problem | None:
    reach = float(samples.beat_phase.max())
    if reach >= LEAST_REACH:
        return None
    return Problem(
        samples.source,
        f"the longest trigger delay is {samples.time_ms.max():g} ms, and reaches {reach:.3f} of its beat",
        "give the delay from the R peak in ms, up to late diastole",
        column="trigger_delay_ms",
    )


def other_unit(speed_m_s: FloatArray, source: str) -> Problem | None:
    """Return what is wrong where the median of accepted speeds cannot be one in m/s."""
    median = float(np.median(speed_m_s))
    low, high = MEDIAN_SPEED_RANGE_M_S
    if low <= median <= high:
        return None
    return Problem(
        source,
        f"the median shear-wave speed is {median:.3g} m/s, expected {low:g} to {high:g}",
        "check the unit: m/s; kPa are for the column youngs_modulus_kpa",
        column=SPEED,
    )


def ingest(
    samples: Samples,
    context: Context,
    settings: RecordingSettings,
    grid_size: int,
    clinical: ClinicalMeasures = NOT_MEASURED,
) -> Observation:
    """Turn raw samples into the observed curve of one subject, or refuse them.

    Quality control, of samples and of whole phases; spatial mean of c_s at each phase; then E = 3 rho c_s^2,
    in this order, since the mean of squares exceeds the square of the mean. A phase without samples stays,
    marked by ``measured``. The analysis grid has ``grid_size`` points.
    """
    verdict = rejection(samples, settings)
    accepted, rejected = count_by_phase(samples, verdict, settings.phases)
    if not accepted.any():
        counts = ", ".join(f"{reason} {n}" for reason, n in zip(REASONS, rejected.sum(axis=1), strict=True))
        reason = f"no sample is acceptable ({counts})"
        raise refusal(samples.source, reason, _advice(samples, settings))
    raise_any(implausible(samples, verdict == ACCEPTED, context, settings))
    speeds = average_speeds(samples, verdict == ACCEPTED, settings.phases)
    regular = ~ectopic(samples, settings.max_rr_deviation_fraction)
    located = locate_phases(samples, speeds.beat_phase, regular)
    order = np.argsort(located)
    phase, speed, error = located[order], speeds.speed_m_s[order], speeds.speed_se_m_s[order]
    measured = ~np.isnan(speed)
    raise_any(incomplete(phase, measured, settings, samples.source))
    if speed[measured].min() == speed[measured].max():
        reason = f"every phase has the same speed, {speed[measured][0]:g} m/s: no beat looks so"
        raise refusal(samples.source, reason, "check what the column holds", column=SPEED)
    stiffness = youngs_modulus_kpa(speed, settings.density_kg_m3)
    return Observation(
        context=context,
        phase=phase,
        phase_index=order,
        cell=np.arange(len(order)),
        measured=measured,
        speed_m_s=speed,
        speed_se_m_s=error,
        stiffness_kpa=stiffness,
        stiffness_se_kpa=2.0 * stiffness * error / speed,  # first order: dE / E = 2 dc / c
        samples_accepted=accepted[order],
        samples_by_repeat=count_by_repeat(samples, verdict == ACCEPTED, settings.phases)[order],
        samples_rejected=rejected[:, order],
        noise=speeds.noise,
        grid_points=grid_size,
        clinical=clinical,
    )


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
