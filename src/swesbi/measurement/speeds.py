"""Speeds, measured and predicted: log c = 1/2 log((E_pass + E_act) / (3 rho)) at a recording's phases.

The passive part runs along the stretch of each simulation's own beat, by its values at both ends and between.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.context import Context
from swesbi.measurement.operator import active_stiffness_map
from swesbi.recording.noise.errors import MeanErrors, mean_errors
from swesbi.recording.observation import Observation
from swesbi.recording.phases import sample_cycle, slope_cycle
from swesbi.recording.speed import NoiseComponents, squared_speed_m2_s2

LEAST_STIFFNESS_KPA: Final = 1e-3  # the spline through a cycle near zero may dip below it
LEAST_EXCURSION: Final = 1e-6  # of the stretch; a wall that moves less does not move


@dataclass(frozen=True)
class SpeedRecording:
    """The points of one recording at which a speed was measured, p of them: gated phases, or pushes.

    Phases ascend in [0, 1). Relative errors are fractions of the speed, without what it shares. ``shared`` is
    the factor W of the errors that the means share, whose covariance is W W^T; shape (p, R), a column for
    each sweep, R = 0 where repeats are separate, and of pushes. The model has one error within a cell of
    pushes. ``errors_log_sd`` is the prior's width of the log of a factor of all errors; 0: they are known.
    """

    context: Context
    phase: FloatArray
    speed_m_s: FloatArray
    relative_se: FloatArray
    shared: FloatArray
    cell: IntArray | None = None
    errors_log_sd: float = 0.0

    @property
    def cells(self) -> IntArray:
        """Cell of each point, within which the model has one error: of each phase its own; shape (p,)."""
        return np.arange(len(self.phase)) if self.cell is None else self.cell

    @property
    def errors(self) -> MeanErrors:
        """The relative errors of the means, own and shared."""
        return MeanErrors(self.relative_se, self.shared)

    def points(self, kept: BoolArray) -> SpeedRecording:
        """Return the recording with some of its phases; ``kept`` of shape (p,)."""
        of_kept = {
            name: getattr(self, name)[kept] for name in ("phase", "speed_m_s", "relative_se", "shared")
        }
        return replace(self, **of_kept, cell=None if self.cell is None else self.cell[kept])

    @property
    def subject(self) -> str:
        """The subject's name."""
        return self.context.subject


def measured_speeds(observation: Observation, noise: NoiseComponents | None = None) -> SpeedRecording:
    """Return the measured points of an observation with their speeds and standard errors.

    By the components of the cohort the errors of gated phases follow from the recording's own numbers of
    repeats and samples, and what they share from which of them each sweep has. Without them they are those of
    the recording itself, which knows of no sweeps. Pushes hold their errors themselves.
    """
    measured, gated = observation.measured, observation.is_gated
    if gated:
        components = observation.noise if noise is None else noise
        errors = mean_errors(observation.samples_by_repeat[measured], components)
    else:
        errors = MeanErrors.separate(observation.relative_se)
    return SpeedRecording(
        context=observation.context,
        phase=observation.phase[measured],
        speed_m_s=observation.speed_m_s[measured],
        relative_se=errors.own,
        shared=errors.shared,
        cell=None if gated else observation.cell[measured],
        errors_log_sd=observation.errors_log_sd,
    )


class WallCycles(Protocol):
    """Simulated cycles of n beats: what the stiffness of the wall is made of, over M phases."""

    @property
    def cycle_phase(self) -> FloatArray:
        """Phases of the cycle; shape (M,)."""

    @property
    def active_stiffness_kpa(self) -> FloatArray:
        """Active stiffness k_c; shape (n, M)."""

    @property
    def stretch(self) -> FloatArray:
        """Wall stretch; shape (n, M)."""


@dataclass(frozen=True)
class WallPhases:
    """What the wall's stiffness is made of in n simulations at p phases, with slopes per cycle; (n, p) each.

    Shortening is 0 at the largest stretch of the own beat, 1 at the smallest.
    """

    active_kpa: FloatArray
    active_slope_kpa: FloatArray
    shortening: FloatArray
    shortening_slope: FloatArray

    def between(self, offset: FloatArray) -> WallPhases:
        """Return the same at instants beside the phases, the centres of p equal parts of the cycle.

        Between two phases lies the cubic of their values and slopes (Hermite). Offsets (n, p) from the phases
        go from -1 to 1, in 1 / p of the cycle.
        """
        if not offset.any():
            return self
        after = offset >= 0.0
        t = np.where(after, offset, offset + 1.0)
        active = _cubic(self.active_kpa, self.active_slope_kpa, t, after)
        shortening = _cubic(self.shortening, self.shortening_slope, t, after)
        return WallPhases(*active, *shortening)

    def rows(self, chosen: slice | BoolArray | NDArray[np.int64]) -> WallPhases:
        """Return some of the simulations."""
        return WallPhases(*(values[chosen] for values in vars(self).values()))


def _cubic(
    values: FloatArray, slopes: FloatArray, t: FloatArray, after: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Return the periodic Hermite cubic through values and slopes per cycle, and its slope; (n, p) each.

    t is the place between two neighbours, 0 to 1: of a phase and the next where ``after``, else of the one
    before and it.
    """
    parts = values.shape[1]
    pairs = []
    for each in (values, slopes / parts):
        pairs += [
            np.where(after, each, np.roll(each, 1, axis=1)),
            np.where(after, np.roll(each, -1, axis=1), each),
        ]
    y0, y1, m0, m1 = pairs
    rise = y1 - y0
    bend, curl = 3.0 * rise - 2.0 * m0 - m1, m0 + m1 - 2.0 * rise
    at = y0 + t * (m0 + t * (bend + t * curl))
    return at, parts * (m0 + t * (2.0 * bend + 3.0 * t * curl))


@dataclass(frozen=True)
class MeasuredBy:
    """What turns the wall of n simulations into speeds; each of shape (n,), the last three also one for all.

    ``stretched_kpa`` is the passive stiffness a at the largest stretch of the beat, ``ratio`` r that at the
    smallest over it, ``middle_factor`` m that at the middle over the geometric mean of the ends.
    ``speed_scale`` q is by what every measured speed is off.
    """

    stretched_kpa: FloatArray
    ratio: FloatArray | float = 1.0
    middle_factor: FloatArray | float = 1.0
    speed_scale: FloatArray | float = 1.0

    def passive_kpa(self, shortening: FloatArray) -> FloatArray:
        """Return the passive stiffness a r^x m^(4 x (1 - x)) in kPa at shortenings x (n, p).

        Its logarithm is a parabola through both ends and the middle: a law of three numbers, whatever the
        stretch that a wall has at rest. r < 1 where shortening softens it, r > 1 where it stiffens.
        """
        bend = 4.0 * shortening * (1.0 - shortening)
        exponent = np.log(_column(self.ratio)) * shortening + np.log(_column(self.middle_factor)) * bend
        return np.asarray(_column(self.stretched_kpa) * np.exp(exponent))

    def passive_log_slope(self, shortening: FloatArray) -> FloatArray:
        """Return the slope of its logarithm in x; (n, p)."""
        bend = 4.0 * np.log(_column(self.middle_factor)) * (1.0 - 2.0 * shortening)
        return np.asarray(np.log(_column(self.ratio)) + bend)


@dataclass(frozen=True)
class PredictedSpeeds:
    """Noiseless log speeds (c in m/s) of n simulations at p phases and their slope per cycle; (n, p) each."""

    log_speed: FloatArray
    slope: FloatArray

    @property
    def speed_m_s(self) -> FloatArray:
        """The speeds themselves; shape (n, p)."""
        return np.asarray(np.exp(self.log_speed))

    def rows(self, chosen: NDArray[np.int_] | BoolArray) -> PredictedSpeeds:
        """Return the simulations that are chosen, by their numbers or by a mask."""
        return PredictedSpeeds(self.log_speed[chosen], self.slope[chosen])


def shortening(stretch: FloatArray) -> FloatArray:
    """Return how far beats (n, M) are shortened: 0 at the largest stretch, 1 at the smallest; (n, M).

    A wall that does not move is not shortened.
    """
    high, low = stretch.max(axis=1, keepdims=True), stretch.min(axis=1, keepdims=True)
    return np.asarray((high - stretch) / np.maximum(high - low, LEAST_EXCURSION))


def wall_at_phases(cycles: WallCycles, phase: FloatArray, map_name: str) -> WallPhases:
    """Take simulated cycles at the phases (p,), by the named map from k_c to E_act; NaN gives NaN."""
    active = active_stiffness_map(map_name)(cycles.active_stiffness_kpa)
    shortened = shortening(cycles.stretch)
    return WallPhases(
        sample_cycle(cycles.cycle_phase, active, phase),
        slope_cycle(cycles.cycle_phase, active, phase),
        sample_cycle(cycles.cycle_phase, shortened, phase),
        slope_cycle(cycles.cycle_phase, shortened, phase),
    )


def predict_speeds(by: MeasuredBy, wall: WallPhases, density_kg_m3: float) -> PredictedSpeeds:
    """Return the noiseless log speeds of n simulations, and their slopes.

    E = E_pass + E_act (paper, Eq. 3) and E = 3 rho c^2 (paper, Sec. 2.1), so log c = log q
    + 1/2 log(E / 3 rho) and d log c / ds = 1/2 E' / E.
    """
    passive = by.passive_kpa(wall.shortening)
    passive_slope = passive * by.passive_log_slope(wall.shortening) * wall.shortening_slope
    stiffness = np.maximum(passive + wall.active_kpa, LEAST_STIFFNESS_KPA)
    log_speed = 0.5 * np.log(squared_speed_m2_s2(stiffness, density_kg_m3))
    return PredictedSpeeds(
        log_speed=log_speed + np.log(_column(by.speed_scale)),
        slope=0.5 * (passive_slope + wall.active_slope_kpa) / stiffness,
    )


def _column(values: FloatArray | float) -> FloatArray:
    """Return a value of each simulation as a column (n, 1), one for all as a scalar (1, 1)."""
    return np.reshape(np.asarray(values, dtype=np.float64), (-1, 1))
