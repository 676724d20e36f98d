"""Speeds of natural waves, which a closing valve sets off: at the closure of each simulation, not at a phase.

A wave after the closure of a valve k runs through the wall as it is then, whenever that is. The model has a
closure of its own, at s_k(phi), so that a speed c_i of such a wave is

    log c_i = log c(s_k(phi); phi) + omega_k m_k + model's error + error of its own,   m_k ~ N(0, 1).

E = 3 rho c^2 is that of a wave in bulk, and this one is guided by a wall that tapers and has blood on both
sides. What that makes wrong is the same from beat to beat: one m_k for all waves of a kind in a recording.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.arrays import BoolArray, FloatArray
from swesbi.heart.closures import valve_closures
from swesbi.heart.simulate import Beats
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.operator import active_stiffness_map
from swesbi.measurement.speeds import PredictedSpeeds, WallPhases
from swesbi.recording.columns import EVENTS, PUSH
from swesbi.recording.phases import sample_each


@dataclass(frozen=True)
class NaturalWaves:
    """Which of the p speeds of a recording are of natural waves; these stand behind all pushes.

    Attributes:
        event: "push", or whose closure set off the wave; shape (p,).
        log_sd: omega_k of each event.
    """

    event: NDArray[np.str_]
    log_sd: Mapping[str, float]

    @property
    def is_push(self) -> BoolArray:
        """Which speeds are of pushes; (p,)."""
        return np.asarray(self.event == PUSH)

    @property
    def shared_log_sd(self) -> FloatArray:
        """Standard deviation omega of what the waves of an event share, 0 of pushes; (p,)."""
        return np.array([self.log_sd.get(str(event), 0.0) for event in self.event])

    def behind(self, pushes: PredictedSpeeds, closures: PredictedSpeeds) -> PredictedSpeeds:
        """Join predictions at pushes with those at closures, (n, 2) in the order of ``EVENTS``; (n, p)."""
        places = [EVENTS.index(str(event)) for event in self.event[~self.is_push]]
        return PredictedSpeeds(
            np.hstack([pushes.log_speed, closures.log_speed[:, places]]),
            np.hstack([pushes.slope, closures.slope[:, places]]),
        )


def predict_at_closures(model: SpeedModel, phi: FloatArray, beats: Beats) -> PredictedSpeeds:
    """Return noiseless log speeds at the closures of simulations, and slopes; (n, 2) as ``EVENTS`` are.

    NaN where a simulation failed, or where its valve never closes.

    Args:
        model: Of the recording; its phases play no part.
        phi: Parameters; shape (n, d).
        beats: Their beats.
    """
    phases = closure_phases(model, beats)
    walls = [_wall(model, beats, phases[event]) for event in EVENTS]
    joined = (
        np.column_stack(values) for values in zip(*(vars(wall).values() for wall in walls), strict=True)
    )
    return model.settings.predict(phi, WallPhases(*joined))


def closure_phases(model: SpeedModel, beats: Beats) -> Mapping[str, FloatArray]:
    """Return the closure of each simulation as a fraction of the cycle, (n,), by event."""
    closures = valve_closures(beats, model.settings.forward_model)
    return dict(zip(EVENTS, (closures.mitral, closures.aortic), strict=True))


def _wall(model: SpeedModel, beats: Beats, phase: FloatArray) -> WallPhases:
    """Return the wall of each of n simulations at a phase of its own; (n,) each."""
    active = active_stiffness_map(model.settings.measurement.active_stiffness_map)(beats.active_stiffness_kpa)
    curves = [(beats.cycle_phase, active), (beats.cycle_phase, beats.stretch)]
    if (reference := model.reference) is not None:
        stretch = np.tile(reference.stretch, (len(phase), 1))
        curves[1] = (reference.cycle_phase, stretch)
    return WallPhases(
        *(sample_each(at, values, phase, derivative) for at, values in curves for derivative in (0, 1))
    )
