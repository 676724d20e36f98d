"""Predictive checks of a free-running recording: new pushes at its instants, and the curve behind them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from swesbi.artefacts import Artefact, Part, Variable
from swesbi.base.arrays import FloatArray
from swesbi.checks.scores import Band, band, coverage
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import PredictedSpeeds
from swesbi.recording.phases import analysis_grid
from swesbi.recording.speed import youngs_modulus_kpa


@dataclass(frozen=True)
class FreePredictiveCheck(Artefact, kind="free_predictive"):
    """What prior and posterior predict of a free-running recording, and how its p pushes lie in it."""

    grid: Annotated[FloatArray, Variable("grid", "1", "analysis phases, fraction of the cycle")]
    prior: Annotated[Band, Part("prior_{}_kpa", "grid", "kPa", words={"noise": " of noiseless curves"})]
    posterior: Annotated[
        Band, Part("posterior_{}_kpa", "grid", "kPa", words={"noise": " of noiseless curves"})
    ]
    phase: Annotated[FloatArray, Variable("push", "1", "instants of the pushes, fraction of the beat")]
    stiffness_kpa: Annotated[FloatArray, Variable("push", "kPa", "observed stiffness 3 rho c_s^2")]
    relative_se: Annotated[FloatArray, Variable("push", "1", "standard error of each speed over it")]
    pushes: Annotated[
        Band, Part("push_{}_kpa", "push", "kPa", words={"noise": " of new pushes, errors included"})
    ]
    interval: Annotated[float, Variable("", "1", "probability mass of every interval")]
    coverage: Annotated[float, Variable("", "1", "share of the pushes inside the interval of new ones")]


def check_pushes(
    model: SpeedModel,
    phi: FloatArray,
    prior_phi: FloatArray,
    interval: float,
    grid_points: int,
    rng: np.random.Generator,
) -> FreePredictiveCheck:
    """Compare a recording with new pushes that draws of its posterior would give at the same instants.

    Args:
        model: The recording and its model.
        phi: Draws of the posterior; shape (n, d).
        prior_phi: Draws of the prior; shape (m, d).
        interval: Mass of the intervals.
        grid_points: Points of the grid.
        rng: Draws the errors.
    """
    recording, density = model.recording, model.settings.density_kg_m3
    grid = analysis_grid(grid_points)
    curves, predicted = _predicted(model, phi, grid)
    prior, _ = _predicted(model, prior_phi, grid)
    observed = youngs_modulus_kpa(recording.speed_m_s, density)
    new = band(youngs_modulus_kpa(model.draw_speeds(predicted, rng), density), interval)
    return FreePredictiveCheck(
        grid=grid,
        prior=band(youngs_modulus_kpa(prior.speed_m_s, density), interval),
        posterior=band(youngs_modulus_kpa(curves.speed_m_s, density), interval),
        phase=recording.phase,
        stiffness_kpa=observed,
        relative_se=recording.relative_se,
        pushes=new,
        interval=interval,
        coverage=coverage(observed, new),
    )


def _predicted(
    model: SpeedModel, phi: FloatArray, grid: FloatArray
) -> tuple[PredictedSpeeds, PredictedSpeeds]:
    """Return the log speeds of the draws that can be simulated, on the grid and at the pushes."""
    beats = model.simulate(phi)
    on_grid = replace(model, recording=replace(model.recording, phase=grid)).predict_from(phi, beats)
    pushes = model.predict_from(phi, beats)
    good = np.flatnonzero(np.isfinite(pushes.log_speed).all(axis=1))
    return on_grid.rows(good), pushes.rows(good)
