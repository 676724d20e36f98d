"""From accepted samples to one speed a phase with its standard error, and from speed to stiffness."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
import pandas as pd

from swesbi.arrays import BoolArray, FloatArray
from swesbi.artefacts import Variable
from swesbi.recording.samples import Samples

PA_PER_KPA: Final = 1e3


def youngs_modulus_kpa(speed_m_s: FloatArray, density_kg_m3: float) -> FloatArray:
    """Return the apparent Young's modulus E = 3 rho c_s^2 in kPa (paper, Sec. 2.1)."""
    return 3.0 * density_kg_m3 * speed_m_s**2 / PA_PER_KPA


def shear_wave_speed_m_s(modulus_kpa: FloatArray, density_kg_m3: float) -> FloatArray:
    """Return the speed c_s = sqrt(E / (3 rho)) in m/s behind an apparent Young's modulus."""
    return np.sqrt(squared_speed_m2_s2(modulus_kpa, density_kg_m3))


def squared_speed_m2_s2(modulus_kpa: FloatArray, density_kg_m3: float) -> FloatArray:
    """Return c_s^2 = E / (3 rho) behind an apparent Young's modulus."""
    return modulus_kpa * PA_PER_KPA / (3.0 * density_kg_m3)


@dataclass(frozen=True)
class NoiseComponents:
    """Relative standard deviations: between repeats, between samples of a repeat, and between sweeps.

    Where each phase is repeated by itself there are no sweeps, and ``sweep_fraction`` is 0. It is not stored
    with a recording, whose few sweeps tell little of it: they are part of what its repeats differ by.
    """

    repeat_fraction: Annotated[
        float, Variable("", "1", "relative standard deviation between repeats", "repeat_noise_fraction")
    ]
    sample_fraction: Annotated[
        float, Variable("", "1", "relative standard deviation between samples", "sample_noise_fraction")
    ]
    sweep_fraction: float = 0.0

    @property
    def of_separate_repeats(self) -> NoiseComponents:
        """The same where each phase is repeated by itself: what sweeps differ by, its repeats do as well."""
        return NoiseComponents(math.hypot(self.repeat_fraction, self.sweep_fraction), self.sample_fraction)

    def times(self, factor: float) -> NoiseComponents:
        """Return those of recordings whose errors are all so many times as large."""
        return NoiseComponents(*(factor * fraction for fraction in vars(self).values()))


@dataclass(frozen=True)
class PhaseSpeeds:
    """Mean speed at each gated phase, arrays of shape (P,); NaN where no sample was accepted.

    Attributes:
        speed_m_s: Spatial mean of the shear-wave speed c_s over each repeat, then the mean over repeats.
        speed_se_m_s: Its standard error.
        beat_phase: Mean of trigger delay / RR over the same repeats; not wrapped.
        noise: The variance components behind the standard errors.
    """

    speed_m_s: FloatArray
    speed_se_m_s: FloatArray
    beat_phase: FloatArray
    noise: NoiseComponents


def average_speeds(samples: Samples, accepted: BoolArray, phases: int) -> PhaseSpeeds:
    """Average the accepted samples of each phase.

    Samples of one repeat share that repeat's error, so the repeat means, not the samples, are
    independent: the standard error of the mean of R repeats with n_r samples each is
    ``c / R * sqrt(sum_r (s_rep^2 + s_sam^2 / n_r))``.

    Args:
        samples: The recording, N samples.
        accepted: Which samples passed quality control; shape (N,).
        phases: Number P of gated phases.
    """
    repeats = repeat_means(samples, accepted)
    by_phase = repeats.groupby("phase_index")
    speed = by_phase["speed"].mean()
    noise = estimate_noise(repeats)
    variance = noise.repeat_fraction**2 + noise.sample_fraction**2 / repeats["size"]
    relative = np.sqrt(variance.groupby(repeats["phase_index"]).sum()) / by_phase.size()
    per_phase = pd.DataFrame({"speed": speed, "se": speed * relative, "phase": by_phase["beat_phase"].mean()})
    table = per_phase.reindex(np.arange(phases)).to_numpy(dtype=np.float64)
    return PhaseSpeeds(table[:, 0], table[:, 1], table[:, 2], noise)


def repeat_means(samples: Samples, accepted: BoolArray) -> pd.DataFrame:
    """Return one row per phase and repeat with accepted samples.

    Columns: phase_index, repeat, speed (mean, m/s), variance (of the samples; NaN for one), size, beat_phase.
    """
    table = pd.DataFrame(
        {
            "phase_index": samples.phase_index[accepted],
            "repeat": samples.repeat[accepted],
            "speed": samples.speed_m_s[accepted],
            "beat_phase": samples.beat_phase[accepted],
        }
    )
    return (
        table.groupby(["phase_index", "repeat"])
        .agg(
            speed=("speed", "mean"),
            variance=("speed", "var"),
            size=("speed", "size"),
            beat_phase=("beat_phase", "mean"),
        )
        .reset_index()
    )


def estimate_noise(repeats: pd.DataFrame) -> NoiseComponents:
    """Estimate the variance components of a nested design by the method of moments.

    The noise is proportional to the speed, so squared deviations are taken relative to the phase mean
    and pooled over all phases: one phase has too few repeats to estimate its own. With v_r = s_rep^2 +
    s_sam^2 / n_r, the expected sum of squares of R repeat means about their mean is
    (1 - 1/R) sum_r v_r (Searle, Casella and McCulloch, Variance Components, 1992).

    Beats differ in RR, so repeats at one delay lie at slightly different phases; what they differ by on
    the slope of the curve is no error, since the phase is averaged like the speed, and is taken out first.

    Args:
        repeats: As returned by :func:`repeat_means`.
    """
    phase = repeats.groupby("phase_index")["speed"]
    mean, count = phase.transform("mean"), phase.transform("size")
    freedom_within = repeats["size"] - 1
    within = (repeats["variance"].fillna(0.0) * freedom_within / mean**2).sum()
    sample_variance = within / max(int(freedom_within.sum()), 1)
    excess = ((repeats["speed"] / mean - 1.0 - phase_trend(repeats)) ** 2).sum()
    excess -= ((1.0 - 1.0 / count) * sample_variance / repeats["size"]).sum()
    repeat_variance = max(excess / max((1.0 - 1.0 / count).sum(), 1.0), 0.0)
    return NoiseComponents(float(np.sqrt(repeat_variance)), float(np.sqrt(sample_variance)))


def phase_trend(repeats: pd.DataFrame) -> pd.Series[float]:
    """Return by what fraction each repeat's speed should differ from the phase mean for its beat's phase.

    The slope at a phase is the central difference over its neighbours around the cycle.
    """
    by_phase = repeats.groupby("phase_index")
    mean = by_phase[["beat_phase", "speed"]].mean().sort_values("beat_phase")
    phase = np.pad(mean["beat_phase"].to_numpy(np.float64), 1, mode="wrap")
    phase[0] -= 1.0
    phase[-1] += 1.0
    speed = np.pad(mean["speed"].to_numpy(np.float64), 1, mode="wrap")
    with np.errstate(
        divide="ignore", invalid="ignore"
    ):  # phases that coincide are refused where they are located
        slope = (speed[2:] - speed[:-2]) / (phase[2:] - phase[:-2])
    relative = pd.Series(slope / speed[1:-1], mean.index)
    shift = repeats["beat_phase"] - by_phase["beat_phase"].transform("mean")
    return shift * repeats["phase_index"].map(relative)
