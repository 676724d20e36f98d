"""Speeds, measured and predicted: log c = 1/2 log((a g + E_act) / (3 rho)) at a recording's phases."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.arrays import FloatArray
from swesbi.context import Context
from swesbi.heart.periodic import Status
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import simulate
from swesbi.measurement.operator import active_stiffness_map, passive_shape
from swesbi.recording.noise import relative_se
from swesbi.recording.observation import Observation
from swesbi.recording.phases import sample_cycle, slope_cycle
from swesbi.recording.speed import NoiseComponents, squared_speed_m2_s2

LEAST_STIFFNESS_KPA: Final = 1e-3  # the spline through a cycle near zero may dip below it


@dataclass(frozen=True)
class SpeedRecording:
    """One recording's measured phases, p of them; missing ones are left out.

    Attributes:
        context: The subject's context.
        phase: Measured phases in [0, 1), ascending; shape (p,).
        speed_m_s: Mean shear-wave speed there; shape (p,).
        relative_se: Standard error of each mean as a fraction of it; shape (p,).
    """

    context: Context
    phase: FloatArray
    speed_m_s: FloatArray
    relative_se: FloatArray

    @property
    def subject(self) -> str:
        """The subject's name."""
        return self.context.subject


def measured_speeds(observation: Observation, noise: NoiseComponents | None = None) -> SpeedRecording:
    """Return the measured phases of an observed curve with their speeds and standard errors.

    Args:
        observation: The observed curve.
        noise: Components of the cohort, from which the standard errors follow by the recording's own
            numbers of repeats and samples; without them, those of the recording itself.
    """
    measured = observation.measured
    components = observation.noise if noise is None else noise
    return SpeedRecording(
        context=observation.context,
        phase=observation.phase[measured],
        speed_m_s=observation.speed_m_s[measured],
        relative_se=relative_se(observation.samples_by_repeat[measured], components),
    )


@dataclass(frozen=True)
class PassiveShape:
    """The passive stiffness per unit of its scale, g(lambda_ref(s)), over the cycle; M points.

    Attributes:
        cycle_phase: Phases of the simulated cycle; shape (M,).
        shape: g along the stretch of the reference beat, dimensionless; shape (M,).
    """

    cycle_phase: FloatArray
    shape: FloatArray


@dataclass(frozen=True)
class ActivePhases:
    """The active stiffness of n simulations at p phases, and its slope per cycle; (n, p) each, in kPa."""

    stiffness_kpa: FloatArray
    slope_kpa: FloatArray


@dataclass(frozen=True)
class PredictedSpeeds:
    """Noiseless log speeds (c in m/s) of n simulations at p phases and their slope per cycle; (n, p) each."""

    log_speed: FloatArray
    slope: FloatArray

    @property
    def speed_m_s(self) -> FloatArray:
        """The speeds themselves; shape (n, p)."""
        return np.asarray(np.exp(self.log_speed))

    def rows(self, chosen: NDArray[np.int_]) -> PredictedSpeeds:
        """Return the simulations that are chosen, by their numbers."""
        return PredictedSpeeds(self.log_speed[chosen], self.slope[chosen])


def reference_shape(
    context: Context, reference_theta: FloatArray, forward_model: ForwardModelSettings, exponent_b: float
) -> PassiveShape:
    """Simulate the reference beat at ``reference_theta`` (3,) and return g along its stretch.

    Raises:
        ValueError: The reference beat does not become periodic.
    """
    beats = simulate(reference_theta[None], context, forward_model)
    if beats.status[0] != Status.PERIODIC:
        raise ValueError(
            f"subject {context.subject}: the reference beat did not become periodic; check the context"
        )
    return PassiveShape(beats.cycle_phase, passive_shape(beats.stretch[0], exponent_b))


def active_at_phases(
    cycle_phase: FloatArray, active_stiffness_kpa: FloatArray, phase: FloatArray, map_name: str
) -> ActivePhases:
    """Return E_act of simulated cycles (n, M) at the phases (p,), by the named map from k_c to E_act."""
    active = active_stiffness_map(map_name)(active_stiffness_kpa)
    return ActivePhases(sample_cycle(cycle_phase, active, phase), slope_cycle(cycle_phase, active, phase))


def predict_speeds(
    scale_kpa: FloatArray, active: ActivePhases, shape: PassiveShape, phase: FloatArray, density_kg_m3: float
) -> PredictedSpeeds:
    """Return the noiseless log speeds of n simulations of one context, and their slopes.

    Args:
        scale_kpa: Passive scale a of each simulation; shape (n,).
        active: Active stiffness at the phases.
        shape: g over the cycle.
        phase: The phases; shape (p,).
        density_kg_m3: rho.
    """
    g = sample_cycle(shape.cycle_phase, shape.shape[None], phase)
    g_slope = slope_cycle(shape.cycle_phase, shape.shape[None], phase)
    return combine(scale_kpa, active, g, g_slope, density_kg_m3)


def combine(
    scale_kpa: FloatArray, active: ActivePhases, g: FloatArray, g_slope: FloatArray, density_kg_m3: float
) -> PredictedSpeeds:
    """Return the noiseless log speeds of n simulations with their passive and active stiffness.

    E = a g + E_act (paper, Eq. 3) and E = 3 rho c^2 (paper, Sec. 2.1), so log c = 1/2 log(E / (3 rho))
    and d log c / ds = 1/2 E' / E.

    Args:
        scale_kpa: Passive scale a of each simulation; shape (n,).
        active: Active stiffness at the p phases.
        g: Passive stiffness per unit of its scale there; shape (1, p), or (n, p) where contexts differ.
        g_slope: Its slope per cycle; likewise.
        density_kg_m3: rho.
    """
    stiffness = np.maximum(scale_kpa[:, None] * g + active.stiffness_kpa, LEAST_STIFFNESS_KPA)
    slope = scale_kpa[:, None] * g_slope + active.slope_kpa
    return PredictedSpeeds(
        log_speed=0.5 * np.log(squared_speed_m2_s2(stiffness, density_kg_m3)),
        slope=0.5 * slope / stiffness,
    )
