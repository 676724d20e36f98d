"""Curves of theta as a subject was measured, and their scores."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.checks.scores import NO_SCORES, Scores, band, score
from swesbi.heart.periodic import Status
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import simulate
from swesbi.measurement.likelihood import MeasuredSubject


def simulated_curves(
    theta: FloatArray, subject: MeasuredSubject, forward_model: ForwardModelSettings
) -> FloatArray:
    """Return the curves (n, grid) of theta (n, 3) in kPa; NaN where the simulation failed."""
    beats = simulate(theta, subject.observation.context, forward_model)
    good = beats.status == Status.PERIODIC
    curves = np.full((len(theta), subject.measurement.grid_points), np.nan)
    if good.any():
        curves[good] = subject.on_grid(beats.cycle_phase, beats.active_stiffness_kpa[good])
    return curves


@dataclass(frozen=True)
class CurveScores:
    """Scores of one predictive distribution against one recording; NaN where there is no draw."""

    grid: Scores
    phases: Scores


def score_theta(
    theta: FloatArray, subject: MeasuredSubject, forward_model: ForwardModelSettings, interval: float
) -> CurveScores:
    """Simulate theta (n, 3), n may be 0, and score the successful curves by intervals of a mass."""
    if not len(theta):
        return CurveScores(NO_SCORES, NO_SCORES)
    recording = subject.observation
    beats = simulate(theta, recording.context, forward_model)
    cycles = (beats.cycle_phase, beats.active_stiffness_kpa[beats.status == Status.PERIODIC])
    grid, phases = subject.on_grid(*cycles), subject.at_phases(*cycles)[:, recording.measured]
    observed, phase = recording.stiffness_kpa[recording.measured], recording.phase[recording.measured]
    return CurveScores(
        grid=score(recording.grid, recording.curve_kpa, band(grid, interval)),
        phases=score(phase, observed, band(phases, interval)),
    )
