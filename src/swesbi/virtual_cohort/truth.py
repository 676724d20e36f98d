"""The true stiffness curve of a virtual volunteer: richer mechanics and a passive exponent of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.forward_model.beats import Beats
from swesbi.forward_model.periodic import Status
from swesbi.forward_model.simulate import simulate
from swesbi.observation.passive import passive_shape
from swesbi.virtual_cohort.volunteers import LATE_DIASTOLE, Volunteer, forward_model_of

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class TruthCurve:
    """A noiseless curve of total stiffness: phases in [0, 1), ascending, and kPa; each of shape (M,)."""

    cycle_phase: FloatArray
    stiffness_kpa: FloatArray


@dataclass(frozen=True)
class Truth:
    """All that is true of one volunteer: the beat, the passive scale, the passive and the total curve."""

    volunteer: Volunteer
    beats: Beats
    passive_scale_kpa: float
    passive_kpa: FloatArray
    curve: TruthCurve

    @property
    def active_kpa(self) -> FloatArray:
        """The active stiffness k_c of the beat; shape (M,)."""
        return np.asarray(self.beats.active_stiffness_kpa[0])


def simulate_truth(volunteer: Volunteer) -> Truth:
    """Simulate a volunteer and set the passive scale so that late diastole has its designed stiffness.

    Raises:
        RuntimeError: The simulation is not periodic.
    """
    beats = simulate(np.array([volunteer.theta]), volunteer.context, forward_model_of(volunteer))
    if beats.status[0] != Status.PERIODIC:
        raise RuntimeError(f"volunteer {volunteer.context.subject}: {Status(beats.status[0]).name}")
    window = (beats.cycle_phase >= LATE_DIASTOLE[0]) & (beats.cycle_phase <= LATE_DIASTOLE[1])
    active = beats.active_stiffness_kpa[0]
    shape = passive_shape(beats.stretch[0], volunteer.passive_exponent_b)
    scale = float((volunteer.late_diastolic_kpa - active[window].mean()) / shape[window].mean())
    curve = TruthCurve(beats.cycle_phase, scale * shape + active)
    return Truth(volunteer, beats, scale, scale * shape, curve)


def true_curve(volunteer: Volunteer) -> TruthCurve:
    """Return the noiseless total stiffness of a volunteer."""
    return simulate_truth(volunteer).curve
