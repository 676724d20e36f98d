"""Scores of predictive curves alone, on the grid and on the measured phases, without their features."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.evaluation.scores import Scores, band, score
from swesbi.evaluation.subject_model import SubjectModel
from swesbi.forward_model.periodic import Status

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class CurveScores:
    """Scores of one predictive distribution against one recording; NaN where there is no draw."""

    grid: Scores
    phases: Scores


def score_theta(theta: FloatArray, model: SubjectModel, interval: float) -> CurveScores:
    """Simulate theta (n, 3) and score the successful curves; n may be 0."""
    if len(theta) == 0:
        return _score(np.empty((0, len(model.observation.grid))), _no_phases(model), model, interval)
    beats = model.simulate(theta)
    good = beats.status == Status.PERIODIC
    return score_cycles(beats.cycle_phase, beats.active_stiffness_kpa[good], model, interval)


def score_cycles(
    cycle_phase: FloatArray, active_stiffness_kpa: FloatArray, model: SubjectModel, interval: float
) -> CurveScores:
    """Score simulated cycles.

    Args:
        cycle_phase: (M,) phases of the simulated cycle.
        active_stiffness_kpa: (n, M) active stiffness of successful simulations.
        model: Recording, passive baseline and measurement operator.
        interval: Mass of the central predictive interval.
    """
    cycles = (cycle_phase, active_stiffness_kpa)
    return _score(model.on_grid(*cycles), model.at_phases(*cycles), model, interval)


def _score(grid: FloatArray, phases: FloatArray, model: SubjectModel, interval: float) -> CurveScores:
    recording = model.observation
    measured = recording.measured
    return CurveScores(
        grid=score(recording.grid, recording.curve_kpa, band(grid, interval)),
        phases=score(
            recording.phase[measured],
            recording.stiffness_kpa[measured],
            band(phases[:, measured], interval),
        ),
    )


def _no_phases(model: SubjectModel) -> FloatArray:
    return np.empty((0, len(model.observation.phase)))
