"""From a simulated beat to the curve that elastography would show: active part, passive baseline, total.

The passive baseline is small in systole, where the wall is short, and grows with stretch; exponential laws of
this kind are usual for passive myocardium (Fung). The stretch is that of one reference beat of the subject.

Total stiffness is E_sim = E_pass + E_act (paper, Eq. 3). It is taken at the subject's own measured
phases and interpolated from them, as the observed curve is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Final, TypeAlias

import numpy as np

from swesbi.artefacts import Artefact, Variable
from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.measurement.settings import MeasurementSettings, PassiveSettings
from swesbi.recording.phases import sample_cycle, to_grid

if TYPE_CHECKING:
    from swesbi.heart.simulate import Beats
    from swesbi.recording.observation import Observation

StiffnessMap = Callable[[FloatArray], FloatArray]
# Chosen: several times the peaks of the study, so that the map bends them only.
SERIES_MODULUS_KPA: Final = 300.0
PERIODIC = 0  # Status.PERIODIC of the forward model, which need not be compiled for this
ActiveCycles: TypeAlias = tuple[FloatArray, FloatArray]
"""Cycle phases (M,) of simulated beats, and their active stiffness (n, M) in kPa."""


def identity(active_stiffness_kpa: FloatArray) -> FloatArray:
    """Return E_act = k_c: the stiffness d tau_c / d e_c of the attached bonds, frozen for the wave's time.

    A shear wave passes in a millisecond, in which bonds neither form nor break (active law of Chapelle
    et al. 2012).
    """
    return active_stiffness_kpa


def series_spring(active_stiffness_kpa: FloatArray) -> FloatArray:
    """Return E_act = k_c E_s / (k_c + E_s): the bonds with an elastic element in series.

    Sarcomere models have such an element (Caruel et al. 2014, where its strain is part of the fibre's);
    here it is rigid in the mechanics and enters the measured stiffness alone, to see what it would change.
    """
    return active_stiffness_kpa * SERIES_MODULUS_KPA / (active_stiffness_kpa + SERIES_MODULUS_KPA)


ACTIVE_STIFFNESS_MAPS: Final[Mapping[str, StiffnessMap]] = {
    "identity": identity,
    "series_spring": series_spring,
}


def active_stiffness_map(name: str) -> StiffnessMap:
    """Return the map of this name; a further one is added to ``ACTIVE_STIFFNESS_MAPS`` and the settings."""
    if name not in ACTIVE_STIFFNESS_MAPS:
        raise ValueError(f"no active stiffness map {name!r}; known: {', '.join(ACTIVE_STIFFNESS_MAPS)}")
    return ACTIVE_STIFFNESS_MAPS[name]


class PassiveCalibrationError(ValueError):
    """The passive baseline cannot be calibrated; the message says why and what to do."""


@dataclass(frozen=True)
class PassiveBaseline(Artefact, kind="passive"):
    """Passive stiffness along the reference beat, M cycle points."""

    scale_kpa: Annotated[float, Variable("", "kPa", "scale a_d: passive stiffness at stretch 1")]
    cycle_phase: Annotated[FloatArray, Variable("cycle", "1", "fraction of the cycle from the R peak")]
    stretch: Annotated[FloatArray, Variable("cycle", "1", "wall stretch of the reference beat")]
    stiffness_kpa: Annotated[FloatArray, Variable("cycle", "kPa", "passive stiffness E_pass")]
    late_diastolic_observed_kpa: Annotated[
        float, Variable("", "kPa", "observed late-diastolic mean, which is met")
    ]
    late_diastolic_active_kpa: Annotated[
        float, Variable("", "kPa", "active part of it in the reference beat")
    ]


def passive_shape(stretch: FloatArray, exponent_b: float) -> FloatArray:
    """Return the baseline's law g = exp(b (lambda^2 - 1)), dimensionless, for stretches of any shape."""
    return np.asarray(np.exp(exponent_b * (stretch**2 - 1.0)))


def passive_scale(
    observed_kpa: FloatArray, active_kpa: FloatArray, shape: FloatArray, window: BoolArray
) -> FloatArray:
    """Return the scale a in kPa that makes passive plus active stiffness meet the observed mean in a window.

    Observed stiffness may be of several recordings (..., P), which gives scales (...); active stiffness and
    shape are those of the reference beat (P,). Where the active part alone is above the mean, a is negative.
    """
    excess = observed_kpa[..., window].mean(axis=-1) - active_kpa[window].mean()
    return np.asarray(excess / shape[window].mean())


def late_diastolic(observation: Observation, settings: PassiveSettings) -> BoolArray:
    """Return which phases are measured and lie in the late-diastolic window; shape (P,)."""
    low, high = settings.late_diastolic_window
    return observation.measured & (observation.phase >= low) & (observation.phase <= high)


def calibrate_passive(
    observation: Observation,
    reference: Beats,
    settings: PassiveSettings,
    measurement: MeasurementSettings,
) -> PassiveBaseline:
    """Calibrate the passive baseline of one subject on the measured late-diastolic phases.

    The reference beat runs in the subject's context. PassiveCalibrationError: it failed, the window has no
    measured phase, or the stiffness there does not exceed the reference beat's active part.
    """
    window = late_diastolic(observation, settings)
    _check_inputs(observation.subject, reference, window, settings)
    active = active_stiffness_map(measurement.active_stiffness_map)(reference.active_stiffness_kpa[0])
    shape = passive_shape(reference.stretch[0], settings.exponent_b)
    active_there, shape_there = sample_cycle(
        reference.cycle_phase, np.stack([active, shape]), observation.phase
    )
    scale = float(passive_scale(observation.stiffness_kpa, active_there, shape_there, window))
    observed = float(observation.stiffness_kpa[window].mean())
    active_part = float(active_there[window].mean())
    if not scale > 0.0:
        raise PassiveCalibrationError(
            f"subject {observation.subject}: the observed late-diastolic stiffness, {observed:.2f} kPa, does "
            f"not exceed the active part of the reference beat, {active_part:.2f} kPa; check the "
            "late-diastolic speeds, or move passive.late_diastolic_window"
        )
    return PassiveBaseline(
        scale, reference.cycle_phase, reference.stretch[0], scale * shape, observed, active_part
    )


def _check_inputs(subject: str, reference: Beats, window: BoolArray, settings: PassiveSettings) -> None:
    if len(reference.status) != 1 or reference.status[0] != PERIODIC:
        raise PassiveCalibrationError(
            f"subject {subject}: the reference beat did not become periodic; check the subject's context "
            "and the prior's centres"
        )
    if not window.any():
        low, high = settings.late_diastolic_window
        raise PassiveCalibrationError(
            f"subject {subject}: no measured phase lies in the late-diastolic window [{low:g}, {high:g}]; "
            "widen passive.late_diastolic_window"
        )


def total_cycle(active: ActiveCycles, passive: PassiveBaseline, settings: MeasurementSettings) -> FloatArray:
    """Return total stiffness E_pass + E_act over the simulated cycle, shape (n, M), in kPa."""
    cycle_phase, active_stiffness_kpa = active
    if not np.array_equal(cycle_phase, passive.cycle_phase):
        raise ValueError(
            f"the simulated cycle has {len(cycle_phase)} points, the passive baseline "
            f"{len(passive.cycle_phase)}, or other phases; make both under the same forward-model settings"
        )
    return passive.stiffness_kpa + active_stiffness_map(settings.active_stiffness_map)(active_stiffness_kpa)


def total_at_phases(
    active: ActiveCycles, passive: PassiveBaseline, observation: Observation, settings: MeasurementSettings
) -> FloatArray:
    """Return total stiffness at every phase of the recording, measured or not, shape (n, P), in kPa."""
    return sample_cycle(active[0], total_cycle(active, passive, settings), observation.phase)


def total_curves(
    active: ActiveCycles, passive: PassiveBaseline, observation: Observation, settings: MeasurementSettings
) -> FloatArray:
    """Return total stiffness (n, G) in kPa on the analysis grid, as the subject's measured phases show it.

    Failed simulations are dropped before: a cycle with NaN is a ValueError.
    """
    total = total_cycle(active, passive, settings)
    phase = observation.measured_phase
    return to_grid(phase, sample_cycle(active[0], total, phase), settings.grid_points)
