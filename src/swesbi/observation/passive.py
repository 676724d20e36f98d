"""The passive baseline E_pass,d(s) = a_d exp(b (lambda_ref,d(s)^2 - 1)) and its calibration in late diastole.

It is small in systole, where the wall is short, and grows with stretch; exponential laws of this kind are
usual for passive myocardium (Fung). The stretch is that of one reference beat in the subject's context.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import Variable
from swesbi.observation.interpolation import sample_cycle
from swesbi.observation.settings import MeasurementSettings, PassiveSettings
from swesbi.observation.stiffness_map import active_stiffness_map

if TYPE_CHECKING:
    from swesbi.forward_model.beats import Beats
    from swesbi.recording.observation import Observation

FloatArray = NDArray[np.float64]
PERIODIC = 0  # Status.PERIODIC of the forward model, which need not be compiled for this


class PassiveCalibrationError(ValueError):
    """The passive baseline cannot be calibrated; the message says why and what to do."""


@dataclass(frozen=True)
class PassiveBaseline:
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
    """Return g(lambda) = exp(b (lambda^2 - 1)), dimensionless, for stretches of any shape."""
    return np.exp(exponent_b * (stretch**2 - 1.0))


def passive_scale(
    observed_kpa: FloatArray, active_kpa: FloatArray, shape: FloatArray, window: NDArray[np.bool_]
) -> FloatArray:
    """Return the scale a that makes passive plus active stiffness meet the observed mean in a window.

    Args:
        observed_kpa: Observed stiffness at the phases, of one or several recordings; shape (..., P).
        active_kpa: Active stiffness of the reference beat there; shape (P,).
        shape: g of the reference beat there; shape (P,).
        window: Which phases count; shape (P,).

    Returns:
        The scale in kPa, shape (...); not positive if the active part alone exceeds the observed mean.
    """
    excess = observed_kpa[..., window].mean(axis=-1) - active_kpa[window].mean()
    return np.asarray(excess / shape[window].mean())


def late_diastolic(observation: Observation, settings: PassiveSettings) -> NDArray[np.bool_]:
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

    Args:
        observation: The subject's observed curve.
        reference: One beat, simulated in the subject's context at the reference theta.
        settings: Exponent and window.
        measurement: Names the map from active stiffness to E_act.

    Raises:
        PassiveCalibrationError: The reference beat failed, the window holds no measured phase, or the
            observed stiffness there does not exceed the reference beat's active part.
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


def _check_inputs(
    subject: str, reference: Beats, window: NDArray[np.bool_], settings: PassiveSettings
) -> None:
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
