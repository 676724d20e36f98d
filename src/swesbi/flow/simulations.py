"""What the flow learns from: simulations at the measured phases of each subject, noise not yet added."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.prior import draw_passive_scale
from swesbi.simulations.draw import PriorSimulations
from swesbi.speed_model.likelihood import draw_speeds
from swesbi.speed_model.model import SpeedModel
from swesbi.speed_model.prediction import ActivePhases, active_at_phases, predict_speeds

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class SubjectSimulations:
    """n prior simulations of one subject at the p measured phases of its recording.

    Attributes:
        model: The subject's recording and passive shape under the experiment's settings.
        theta: Parameters; shape (n, 3).
        active: Active stiffness at the phases and its slope; (n, p) each.
    """

    model: SpeedModel
    theta: FloatArray
    active: ActivePhases

    def rows(self, start: int, stop: int) -> SubjectSimulations:
        """Return the simulations from ``start`` to before ``stop``."""
        part = slice(start, stop)
        active = ActivePhases(self.active.stiffness_kpa[part], self.active.slope_kpa[part])
        return SubjectSimulations(self.model, self.theta[part], active)


def at_phases(simulations: PriorSimulations, model: SpeedModel) -> SubjectSimulations:
    """Take stored simulations at the measured phases of a recording."""
    active = active_at_phases(
        simulations.cycle_phase,
        simulations.active_stiffness_kpa,
        model.recording.phase,
        model.settings.measurement.active_stiffness_map,
    )
    return SubjectSimulations(model, simulations.theta, active)


def noisy_speeds(simulations: SubjectSimulations, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Draw a passive scale, noise and discrepancy for each simulation.

    Returns:
        phi of shape (n, 4), and the speeds in m/s of shape (n, p).
    """
    model, settings = simulations.model, simulations.model.settings
    scale = draw_passive_scale(len(simulations.theta), settings.prior, rng)
    predicted = predict_speeds(
        scale, simulations.active, model.shape, model.recording.phase, settings.density_kg_m3
    )
    speeds = draw_speeds(predicted, model.recording.relative_se, settings.discrepancy, rng)
    return np.column_stack([simulations.theta, scale]), speeds
