"""Quality control of a free-running recording: pushes by themselves, then pushes beside their neighbours."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from swesbi.base.arrays import IntArray
from swesbi.recording.free_noise import FreeNoise, free_noise
from swesbi.recording.free_samples import FreeSamples, free_rejection
from swesbi.recording.neighbours import told_by_neighbours
from swesbi.recording.problems import Problem, RecordingError
from swesbi.recording.samples import ACCEPTED, OUTLIER
from swesbi.recording.settings import NoiseDeclaration, RecordingSettings

VARIES: Final = 0.25
"""Share of the beats left out for their RR interval, above which the rhythm is said to vary."""


@dataclass(frozen=True)
class PushQuality:
    """What quality control makes of N pushes.

    Attributes:
        verdict: Index into ``REASONS`` of each push's rejection, or ``ACCEPTED``; shape (N,).
        noise: Errors of the accepted ones, n of them.
        left_out: The outliers, and what is said of the rhythm, a sentence each.
    """

    verdict: IntArray
    noise: FreeNoise
    left_out: tuple[str, ...]


def push_quality(
    samples: FreeSamples, settings: RecordingSettings, declared: NoiseDeclaration
) -> PushQuality:
    """Judge the pushes; one whose speed lies far outside its neighbours is an outlier.

    As of gated phases, a recording that loses more than ``settings.max_missing_fraction`` so is refused.

    Args:
        samples: The recording, N pushes.
        settings: Quality limits.
        declared: What is said of its errors.

    Raises:
        RecordingError: Nothing tells the errors, or too many pushes lie far outside.
    """
    verdict = free_rejection(samples, settings)
    accepted = np.flatnonzero(verdict == ACCEPTED)
    noise = free_noise(samples, verdict == ACCEPTED, declared)
    speed = samples.speed_m_s[accepted]
    told = told_by_neighbours(samples.phase[accepted], speed, noise.relative_se, settings)
    kept = np.isnan(told)
    verdict[accepted[~kept]] = OUTLIER
    named = tuple(_named(samples, accepted[i], told[i]) for i in np.flatnonzero(~kept))
    if len(named) > settings.max_missing_fraction * len(accepted):
        limit = settings.max_missing_fraction
        reason = f"{len(named)} of {len(accepted)} pushes lie far outside their neighbours, limit {limit:.0%}"
        remedy = f"check the speeds, or state larger errors; the first: {named[0]}"
        raise RecordingError(Problem(samples.source, reason, remedy))
    noted = (*named, *_rhythm(samples, settings.max_rr_deviation_fraction))
    return PushQuality(verdict, replace(noise, relative_se=noise.relative_se[kept]), noted)


def _rhythm(samples: FreeSamples, limit: float) -> tuple[str, ...]:
    """Say how many beats are left out for their RR interval, and what is assumed where the rhythm varies."""
    rr_ms = samples.beats_rr_ms()
    median = float(np.median(rr_ms))
    dropped = int((np.abs(rr_ms / median - 1.0) > limit).sum())
    if not dropped:
        return ()
    unit = "beats" if "beat" in samples.columns else "pushes"
    counted = (
        f"{dropped} of {len(rr_ms)} {unit} are left out: their RR interval lies over {limit:.0%} from the "
        f"median, {median:.0f} ms"
    )
    if dropped <= VARIES * len(rr_ms):
        return (counted,)
    assumed = f"the rhythm varies: the answer takes every beat for one of {median:.0f} ms, as the others are"
    return (counted, assumed)


def _named(samples: FreeSamples, index: int, told_m_s: float) -> str:
    place = samples.places[index] if samples.places else f"push {index}"
    return (
        f"outlier: {place} is left out: {samples.speed_m_s[index]:.3g} m/s at time_ms "
        f"{samples.time_ms[index]:g}, and {told_m_s:.3g} m/s by its neighbours"
    )
