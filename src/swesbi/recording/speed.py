"""From accepted samples to one speed a phase with its standard error, and from speed to stiffness."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from swesbi.artefacts import Variable
from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.recording.samples import Groups, Samples, grouped

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
    """Mean speed at each gated phase, with its standard error; arrays (P,), NaN where no sample was accepted.

    Speeds and ``beat_phase`` (trigger delay / RR, not wrapped) are means over repeats of means over samples.
    """

    speed_m_s: FloatArray
    speed_se_m_s: FloatArray
    beat_phase: FloatArray
    noise: NoiseComponents


@dataclass(frozen=True)
class RepeatMeans:
    """The repeats with accepted samples, R of them by phase and then by number; arrays of shape (R,).

    ``size`` counts their samples, ``scatter`` is the sum of squared deviations from their mean speed.
    """

    phase_index: IntArray
    repeat: IntArray
    size: IntArray
    speed_m_s: FloatArray
    scatter: FloatArray
    beat_phase: FloatArray

    @property
    def phases(self) -> Groups:
        """The repeats of each measured phase."""
        return grouped(self.phase_index)


def average_speeds(samples: Samples, accepted: BoolArray, phases: int) -> PhaseSpeeds:
    """Average the accepted samples (N,) of each of P phases.

    Samples of one repeat share that repeat's error, so the repeat means, not the samples, are
    independent: the standard error of the mean of R repeats with n_r samples each is
    ``c / R * sqrt(sum_r (s_rep^2 + s_sam^2 / n_r))``.
    """
    repeats = repeat_means(samples, accepted)
    noise, by_phase = estimate_noise(repeats), repeats.phases
    variance = noise.repeat_fraction**2 + noise.sample_fraction**2 / repeats.size
    table = np.full((3, phases), np.nan)
    measured = repeats.phase_index[by_phase.first]
    table[0, measured] = by_phase.means(repeats.speed_m_s)
    table[1, measured] = table[0, measured] * np.sqrt(by_phase.sums(variance)) / by_phase.sizes
    table[2, measured] = by_phase.means(repeats.beat_phase)
    return PhaseSpeeds(table[0], table[1], table[2], noise)


def repeat_means(samples: Samples, accepted: BoolArray) -> RepeatMeans:
    """Reduce the accepted samples (N,) of a recording to the means of its repeats."""
    phase_index, repeat = samples.phase_index[accepted], samples.repeat[accepted]
    groups, speed = grouped(phase_index, repeat), samples.speed_m_s[accepted]
    return RepeatMeans(
        phase_index=phase_index[groups.first],
        repeat=repeat[groups.first],
        size=groups.sizes,
        speed_m_s=groups.means(speed),
        scatter=groups.scatter(speed),
        beat_phase=groups.means(samples.beat_phase[accepted]),
    )


def estimate_noise(repeats: RepeatMeans) -> NoiseComponents:
    """Estimate the variance components of a nested design by the method of moments.

    The noise is proportional to the speed, so squared deviations are taken relative to the phase mean and
    pooled over all phases: one phase has too few repeats to estimate its own. With
    v_r = s_rep^2 + s_sam^2 / n_r, the expected sum of squares of R repeat means about their mean is
    (1 - 1/R) sum_r v_r (Searle, Casella and McCulloch, Variance Components, 1992).

    Beats differ in RR, so repeats at one delay lie at slightly different phases; what they differ by on the
    slope of the curve is no error, since the phase is averaged like the speed, and is taken out first.
    """
    phases = repeats.phases
    mean, count = phases.means(repeats.speed_m_s)[phases.of], phases.sizes[phases.of]
    freedom_within = float((repeats.size - 1).sum())
    sample_variance = float((repeats.scatter / mean**2).sum()) / max(freedom_within, 1.0)
    excess = float(((repeats.speed_m_s / mean - 1.0 - phase_trend(repeats)) ** 2).sum())
    excess -= float(((1.0 - 1.0 / count) * sample_variance / repeats.size).sum())
    repeat_variance = max(excess / max(float((1.0 - 1.0 / count).sum()), 1.0), 0.0)
    return NoiseComponents(math.sqrt(repeat_variance), math.sqrt(sample_variance))


def phase_trend(repeats: RepeatMeans) -> FloatArray:
    """Return by what fraction each speed (R,) should differ from the phase mean for its beat's phase.

    The slope at a phase is the central difference over its neighbours around the cycle.
    """
    phases = repeats.phases
    beat_phase, speed = phases.means(repeats.beat_phase), phases.means(repeats.speed_m_s)
    order = np.argsort(beat_phase)
    along, around = np.pad(beat_phase[order], 1, mode="wrap"), np.pad(speed[order], 1, mode="wrap")
    along[0] -= 1.0
    along[-1] += 1.0
    relative = np.empty_like(speed)
    # phases that coincide are refused where they are located
    with np.errstate(divide="ignore", invalid="ignore"):
        relative[order] = (around[2:] - around[:-2]) / (along[2:] - along[:-2]) / around[1:-1]
    return (repeats.beat_phase - beat_phase[phases.of]) * relative[phases.of]
