"""The acquisition noise model: any stiffness curve becomes raw samples, as a scanner would write them.

It serves the shipped recordings and every later re-acquisition, in memory, of true or simulated curves.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.recording.phases import nominal_phases
from swesbi.recording.samples import Samples
from swesbi.recording.settings import AcquisitionSettings
from swesbi.recording.speed import shear_wave_speed_m_s
from swesbi.recording.tables.layout import FAILED_STATUSES, STATUS_OK

SLOWEST_M_S: Final = 0.1
FASTEST_M_S: Final = 12.0
FAILURE_SHARES: Final = (0.35, 0.25, 0.30, 0.10)  # in the order of FAILED_STATUSES
SLOW_OUTLIER: Final = (0.35, 0.60)  # a trailing wave, or a part of the wall at rest
FAST_OUTLIER: Final = (1.60, 2.40)  # a reflected or compressional wave
GOOD_FIT: Final = (18.0, 2.0)  # beta distribution of R2, mean 0.9
POOR_FIT: Final = (0.10, 0.58)
DECIMALS: Final = 3


@dataclass(frozen=True)
class TruthCurve:
    """A noiseless curve of total stiffness: phases in [0, 1), ascending, and kPa; each of shape (M,)."""

    cycle_phase: FloatArray
    stiffness_kpa: FloatArray


def acquire(
    truth: TruthCurve,
    context: Context,
    settings: AcquisitionSettings,
    generator: np.random.Generator,
) -> Samples:
    """Record a curve as a file has it: gated pushes, repeats, spatial samples, noise, outliers and failures.

    Each repeat falls into a beat of its own RR; the push comes at a fixed delay, so the wave meets the
    stiffness at the phase delay / RR of that beat. Speeds are c = sqrt(E / (3 rho)) (paper, Sec. 2.1), times
    (1 + repeat error) (1 + sample error), and times what the recording shares: one factor (1 + sweep error)
    for all phases of a repeat, and exp(scale error) for all speeds. The number of draws does not depend on
    the curve.
    """
    of_repeats = (settings.phases, settings.repeats)
    of_samples = (*of_repeats, settings.samples_per_repeat)
    beat, repeat_error = generator.standard_normal((2, *of_repeats))
    sample_error = generator.standard_normal(of_samples)
    fate, failure, size = generator.random((3, *of_samples))
    good_fit, poor_fit = generator.beta(*GOOD_FIT, of_samples), generator.uniform(*POOR_FIT, of_samples)
    shared = _shared_factor(settings, generator)

    rr_ms = _rr_ms(context, settings, beat)
    delay_ms = np.round(nominal_phases(settings.phases) * 1e3 * context.period_s)
    clean = _clean_speed(truth, delay_ms[:, None] / rr_ms, settings.density_kg_m3)
    noisy = (clean * shared * (1.0 + settings.repeat_sd_fraction * repeat_error))[..., None]
    speed = noisy * (1.0 + settings.sample_sd_fraction * sample_error)
    failed = fate < settings.failed_fraction
    failed[list(settings.missing_phases)] = True
    wrong = ~failed & (fate > 1.0 - settings.outlier_fraction)
    speed = np.clip(np.where(wrong, speed * _outlier_factor(size), speed), SLOWEST_M_S, FASTEST_M_S)
    status = np.where(failed, _failure_status(failure), STATUS_OK)
    fit_r2 = np.where(status == "low_r2", poor_fit, np.where(failed, np.nan, good_fit))
    phase, repeat, sample = (axis.ravel() for axis in np.indices(speed.shape))
    return Samples(
        gate=phase,
        time_ms=delay_ms[phase],
        rr_ms=rr_ms[phase, repeat],
        repeat=repeat,
        sample=sample,
        speed_m_s=_rounded(np.where(failed, np.nan, speed)),
        fit_r2=_rounded(fit_r2),
        status=status.ravel(),
        source=f"virtual recording of {context.subject}",
    )


def _rounded(values: FloatArray) -> FloatArray:
    return np.round(values.ravel(), DECIMALS)


def _shared_factor(settings: AcquisitionSettings, generator: np.random.Generator) -> FloatArray:
    # Drawn last, and only where there is one: without, whoever draws on from this generator goes on as ever.
    factor = np.ones(settings.repeats)
    if settings.sweep_fraction > 0.0:
        factor = 1.0 + settings.sweep_fraction * generator.standard_normal(settings.repeats)
    if settings.scale_fraction > 0.0:
        factor = factor * np.exp(settings.scale_fraction * generator.standard_normal())
    return factor


def _rr_ms(context: Context, settings: AcquisitionSettings, deviation: FloatArray) -> FloatArray:
    ratio = 1.0 + settings.rr_sd_fraction * deviation
    for beat in settings.ectopic_beats:
        ratio[beat.phase_index, beat.repeat] = beat.rr_ratio
    return np.round(1e3 * context.period_s * ratio)


def _clean_speed(truth: TruthCurve, beat_phase: FloatArray, density_kg_m3: float) -> FloatArray:
    from scipy.interpolate import CubicSpline

    phase = np.append(truth.cycle_phase, truth.cycle_phase[0] + 1.0)
    curve = CubicSpline(phase, np.append(truth.stiffness_kpa, truth.stiffness_kpa[0]), bc_type="periodic")
    return shear_wave_speed_m_s(curve(beat_phase), density_kg_m3)


def _outlier_factor(size: FloatArray) -> FloatArray:
    slow = SLOW_OUTLIER[0] + 2.0 * size * (SLOW_OUTLIER[1] - SLOW_OUTLIER[0])
    fast = FAST_OUTLIER[0] + (2.0 * size - 1.0) * (FAST_OUTLIER[1] - FAST_OUTLIER[0])
    return np.where(size < 0.5, slow, fast)


def _failure_status(failure: FloatArray) -> NDArray[np.str_]:
    edges = np.cumsum(FAILURE_SHARES)[:-1]
    return np.asarray(np.array(FAILED_STATUSES)[np.searchsorted(edges, failure, side="right")])
