"""Quality control of a recording: which samples are accepted, which phases or pushes are left out as a whole.

A gated phase, by the mean of its samples, or a push whose speed lies far outside its neighbours in the cycle
is an outlier. Its log speed is taken for a random walk around the cycle that comes back to where it began,
since but for a steep rise and fall the speed changes slowly. A rise within one step stays, however high:
what lies between its two nearest neighbours is never far outside.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.special import chdtr

from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.recording.noise.errors import DeclaredNoise, declared_noise
from swesbi.recording.problems import refusal
from swesbi.recording.samples import ACCEPTED, MAD_TO_SD, OUTLIER, Samples, sample_rejection
from swesbi.recording.settings import NoiseDeclaration, RecordingSettings
from swesbi.recording.speed import average_speeds

STEPS: Final = 10
"""Of the resolution below the largest speed, in which others are counted."""
RARE: Final = 1.0e-4
VARIES: Final = 0.25
"""Share of the beats left out for their RR interval, above which the rhythm is said to vary."""
EACH_SIDE: Final = 8
"""Neighbours on each side that predict a speed."""
LEVEL_SD: Final = 1.0
"""Prior standard deviation of the mean log speed about the median: a factor of 2.7."""
TENTH: Final = 0.1
"""Of the cycle, over which the setting says how far the walk goes."""
BEYOND: Final = 0.5
"""Share of the largest z-score by which a speed also lies beyond the nearer of its two neighbours."""


@dataclass(frozen=True)
class PushQuality:
    """What quality control makes of N pushes: a verdict on each, errors of the accepted, outliers in words.

    A verdict (N,) is the index into ``REASONS``, or ``ACCEPTED``. ``left_out`` has a sentence an outlier.
    """

    verdict: IntArray
    noise: DeclaredNoise
    left_out: tuple[str, ...]


def rejection(samples: Samples, settings: RecordingSettings) -> IntArray:
    """Return for each gated sample the index into ``REASONS`` of its rejection, or ``ACCEPTED``; shape (N,).

    First as of :func:`swesbi.recording.samples.sample_rejection`; then all samples of a phase whose mean
    speed lies far outside its neighbours are outliers.
    """
    verdict = sample_rejection(samples, settings)
    far = ~np.isnan(_phase_speeds(samples, verdict, settings)[1])
    verdict[far[samples.phase_index] & (verdict == ACCEPTED)] = OUTLIER
    return verdict


def phases_left_out(samples: Samples, settings: RecordingSettings) -> tuple[str, ...]:
    """Name the phases that are left out as a whole, with their speed and what their neighbours say."""
    speed, told = _phase_speeds(samples, sample_rejection(samples, settings), settings)
    return tuple(
        f"outlier: phase_index {index} is left out: its mean speed is {speed[index]:.3g} m/s, and "
        f"{told[index]:.3g} by its neighbours"
        for index in np.flatnonzero(~np.isnan(told))
    )


def _phase_speeds(
    samples: Samples, verdict: IntArray, settings: RecordingSettings
) -> tuple[FloatArray, FloatArray]:
    """Return the mean speed of each phase, NaN where none, and what the neighbours say of far ones; (P,)."""
    accepted, count = verdict == ACCEPTED, int(samples.phase_index.max()) + 1
    told, speed = np.full((2, count), np.nan)
    if np.unique(samples.phase_index[accepted]).size < settings.outlier_min_points:
        return speed, told
    means = average_speeds(samples, accepted, count)
    speed, known = means.speed_m_s, ~np.isnan(means.speed_m_s)
    error = (means.speed_se_m_s / speed)[known]
    told[known] = speed_by_neighbours(means.beat_phase[known] % 1.0, speed[known], error, settings)
    return speed, told


def push_quality(samples: Samples, settings: RecordingSettings, declared: NoiseDeclaration) -> PushQuality:
    """Judge the pushes of a free-running recording; one far outside its neighbours is an outlier.

    As of gated phases, a recording that loses more than ``settings.max_missing_fraction`` so is refused.
    """
    verdict = sample_rejection(samples, settings)
    accepted = np.flatnonzero(verdict == ACCEPTED)
    noise = declared_noise(samples, verdict == ACCEPTED, declared)
    speed = samples.speed_m_s[accepted]
    told = speed_by_neighbours(samples.beat_phase[accepted], speed, noise.relative_se, settings)
    kept = np.isnan(told)
    verdict[accepted[~kept]] = OUTLIER
    named = tuple(_named(samples, accepted[i], told[i]) for i in np.flatnonzero(~kept))
    if len(named) > settings.max_missing_fraction * len(accepted):
        raise refusal(
            samples.source,
            f"{len(named)} of {len(accepted)} pushes lie far outside their neighbours, limit "
            f"{settings.max_missing_fraction:.0%}",
            f"check the speeds, or state larger errors; the first: {named[0]}",
        )
    return PushQuality(verdict, replace(noise, relative_se=noise.relative_se[kept]), named)


def _named(samples: Samples, index: int, told_m_s: float) -> str:
    place = samples.places[index] if samples.places else f"push {index}"
    return (
        f"outlier: {place} is left out: {samples.speed_m_s[index]:.3g} m/s at time_ms "
        f"{samples.time_ms[index]:g}, and {told_m_s:.3g} m/s by its neighbours"
    )


def oddities(samples: Samples, settings: RecordingSettings) -> tuple[str, ...]:
    """Say what of a recording is odd, a sentence each: its rhythm, clipped speeds, what is not used."""
    return (*_rhythm(samples, settings), *clipped(samples.speed_m_s), *samples.left_out)


def _rhythm(samples: Samples, settings: RecordingSettings) -> tuple[str, ...]:
    """Say how many beats of pushes are left out, and what is assumed where the rhythm varies."""
    rr_ms, median, limit = samples.beats_rr_ms, samples.median_rr_ms, settings.max_rr_deviation_fraction
    dropped = int((np.abs(rr_ms / median - 1.0) > limit).sum())
    if samples.is_gated or not dropped:
        return ()
    counted = (
        f"{dropped} of {len(rr_ms)} {'pushes' if samples.beat is None else 'beats'} are left out: their RR "
        f"interval lies over {limit:.0%} from the median, {median:.0f} ms"
    )
    assumed = f"the rhythm varies: the answer takes every beat for one of {median:.0f} ms, as the others are"
    return (counted, assumed) if dropped > VARIES * len(rr_ms) else (counted,)


def clipped(speed_m_s: FloatArray) -> tuple[str, ...]:
    """Say where more speeds than their resolution allows are the largest of all; nothing where none are.

    Just below the largest, speeds fall into steps of the resolution; so many would fall into one by chance,
    and one more. What has by this a chance (Poisson) below ``RARE`` is no chance. Speeds (N,) are those of
    the table, NaN where there is none.
    """
    known = np.sort(speed_m_s[np.isfinite(speed_m_s)])
    steps = np.diff(np.unique(known))
    if steps.size < STEPS:
        return ()
    largest, step = float(known[-1]), float(steps.min())
    number = int((known == largest).sum())
    near = float((known >= largest - (STEPS + 0.5) * step).sum() - number) / STEPS
    if chdtr(2 * number, 2.0 * (1.0 + near)) >= RARE:
        return ()
    share = f"{number} of {len(known)} speeds are the largest of all, {largest:g} m/s"
    return (f"{share}: they seem to be clipped, so the curve may be higher there",)


def speed_by_neighbours(
    phase: FloatArray, speed_m_s: FloatArray, relative_se: FloatArray, settings: RecordingSettings
) -> FloatArray:
    """Return what the neighbours say of each speed that lies far outside them, in m/s; else NaN; shape (n,).

    Phases are in [0, 1), and standard errors are fractions of the speeds; each of shape (n,). The farthest
    speed is taken out first, and the others are judged without it. Of fewer speeds than
    ``settings.outlier_min_points`` none is far outside. The order of the speeds does not matter.
    """
    told = np.full(len(phase), np.nan)
    left = np.argsort(speed_m_s, kind="stable")
    left = left[np.argsort(phase[left], kind="stable")]
    se = np.maximum(relative_se, settings.outlier_min_scale_fraction)
    log_speed = np.log(speed_m_s)
    while len(left) >= settings.outlier_min_points:
        score, said = _far(phase[left], log_speed[left], se[left], settings)
        farthest = int(np.argmax(score))
        if score[farthest] == 0.0:
            break
        told[left[farthest]] = np.exp(said[farthest])
        left = left[np.arange(len(left)) != farthest]
    return told


def _far(
    phase: FloatArray, log_speed: FloatArray, se: FloatArray, settings: RecordingSettings
) -> tuple[FloatArray, FloatArray]:
    """Return the z-score of each of n speeds in order of phase, 0 if not far outside, and what is said."""
    said, sd = _given_others(phase, log_speed, se, settings.outlier_change_per_tenth_log_sd)
    z = np.abs(log_speed - said) / sd
    factor = max(1.0, MAD_TO_SD * float(np.median(z)))
    z, limit = z / factor, settings.outlier_max_abs_z
    far = (z > limit) & _beyond(log_speed, BEYOND * limit * factor * se)
    return np.where(far, z, 0.0), said


def _beyond(log_speed: FloatArray, error: FloatArray) -> BoolArray:
    """Tell which lie beyond both nearest neighbours, by more than the errors of each difference."""
    beside = np.stack([np.roll(log_speed, 1), np.roll(log_speed, -1)])
    distance = log_speed - beside
    allowed = np.hypot(error, np.stack([np.roll(error, 1), np.roll(error, -1)]))
    above, below = (distance > allowed).all(axis=0), (distance < -allowed).all(axis=0)
    return np.asarray(above | below)


def _given_others(
    phase: FloatArray, log_speed: FloatArray, se: FloatArray, change: float
) -> tuple[FloatArray, FloatArray]:
    """Return mean and standard deviation of each log speed given its neighbours; (n,) each.

    A random walk of variance D a cycle that is back after one has the covariance D (d^2 - d + 1/6) / 2 at a
    distance d. Given all others, value i has by the inverse Q of the covariance the variance 1 / Q_ii, and
    it lies (Q y)_i / Q_ii from its mean (Rasmussen and Williams, Gaussian Processes, 2006, Eq. 5.12).
    """
    count = len(phase)
    side = min(EACH_SIDE, (count - 1) // 2)
    near = (np.arange(count)[:, None] + np.arange(-side, side + 1)) % count
    apart = np.abs(phase[near][:, :, None] - phase[near][:, None, :])
    walk = 0.5 * change**2 / TENTH * (apart**2 - apart + 1.0 / 6.0)
    own = np.eye(2 * side + 1) * (se[near] ** 2)[:, None, :]
    unit = np.broadcast_to(np.eye(2 * side + 1)[:, side : side + 1], (count, 2 * side + 1, 1))
    row = np.linalg.solve(walk + own + LEVEL_SD**2, unit)[..., 0]
    variance = 1.0 / row[:, side]
    centred = log_speed - np.median(log_speed)
    residual = variance * np.sum(row * centred[near], axis=1)
    return log_speed - residual, np.sqrt(variance)
