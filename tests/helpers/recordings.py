"""Small recordings made for tests: any curve, with as much or as little noise as a test wants."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swesbi.context import Context
from swesbi.recording.noise.components import RepeatLevels
from swesbi.recording.quality import rejection
from swesbi.recording.samples import ACCEPTED, Samples
from swesbi.recording.settings import RecordingSettings

CONTEXT = Context("T", "F", 25.0, 1.7, 60.0, 90.0, 34.0, 0.8)
PHASES = 20
DENSITY = 1000.0
RECORDING = RecordingSettings(
    phases=PHASES,
    density_kg_m3=DENSITY,
    min_fit_r2=0.6,
    max_rr_deviation_fraction=0.2,
    outlier_max_abs_z=3.5,
    outlier_min_scale_fraction=0.02,
    outlier_change_per_tenth_log_sd=0.25,
    outlier_min_points=11,
    min_samples_per_phase=6,
    min_repeats_per_phase=2,
    max_missing_fraction=0.2,
    max_gap_fraction=0.15,
    late_diastolic_window=(0.80, 0.97),
    min_late_diastolic_phases=2,
)


def nominal_phase(phases: int = PHASES) -> NDArray[np.float64]:
    return (np.arange(phases) + 0.5) / phases


def clean_speed(phases: int = PHASES) -> NDArray[np.float64]:
    return 1.2 + 3.0 * np.exp(-0.5 * ((nominal_phase(phases) - 0.4) / 0.12) ** 2)


def make_samples(
    speed: NDArray[np.float64] | None = None,
    repeat_sd: float = 0.0,
    sample_sd: float = 0.0,
    seed: int = 0,
    repeats: int = 3,
    per_repeat: int = 12,
    phases: int = PHASES,
) -> Samples:
    """Every phase measured, RR 1000 ms, noise relative to the speed."""
    rng = np.random.default_rng(seed)
    shape = (phases, repeats, per_repeat)
    phase, repeat, sample = (axis.ravel() for axis in np.indices(shape))
    speed = clean_speed(phases) if speed is None else speed
    common = 1.0 + repeat_sd * rng.standard_normal((phases, repeats, 1))
    values = speed[:, None, None] * common * (1.0 + sample_sd * rng.standard_normal(shape))
    return Samples(
        gate=phase,
        time_ms=1000.0 * nominal_phase(phases)[phase],
        rr_ms=np.full(phase.shape, 1000.0),
        repeat=repeat,
        sample=sample,
        speed_m_s=values.ravel(),
        fit_r2=np.full(phase.shape, 0.95),
        status=np.full(phase.shape, "ok", dtype="<U9"),
    )


def levels_of(samples: Samples) -> RepeatLevels:
    return RepeatLevels.of(samples, rejection(samples, RECORDING) == ACCEPTED)
