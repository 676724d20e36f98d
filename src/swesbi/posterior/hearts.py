"""A recording as the measurement of a heart: the likelihood of theta and physiology alone.

A beat follows from theta and physiology. Its speeds then follow from the passive stiffness at three stretches
and the scale of the speeds, without another simulation. These four are integrated out (``marginal``), so that
networks and samplers move in the parameters of the heart alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.measurement.clinical import ClinicalModel
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.shared_error import CellErrors, Errors
from swesbi.measurement.speeds import LEAST_STIFFNESS_KPA, WallPhases
from swesbi.parameters import OF_THETA
from swesbi.posterior.marginal import Marginal
from swesbi.posterior.space import of_scores
from swesbi.prior import JointPriorSettings, OperatorPrior, SimulatedPrior, log_of_scores
from swesbi.recording.speed import squared_speed_m2_s2

SCALE: Final = "speed_scale"


@dataclass(frozen=True)
class HeartSettings:
    """What a sampler asks for: the prior of what it moves in."""

    prior: SimulatedPrior


@dataclass(frozen=True)
class HeartModel(Marginal[WallPhases]):
    """Prior and likelihood of hearts, theta and physiology, given a recording; k parameters.

    ``speeds`` predicts the speeds of all parameters phi; ``pressures`` is the same recording with those of a
    cuff, where they are taken. Without ``informed`` their density is only told beside the likelihood.
    """

    speeds: SpeedModel
    pressures: ClinicalModel | None = None
    informed: bool = True

    @property
    def prior(self) -> JointPriorSettings:
        """The prior of all d parameters."""
        return self.speeds.settings.prior

    @property
    def settings(self) -> HeartSettings:
        """Hold the prior of theta and of the free physiology."""
        return HeartSettings(self.prior.simulated)

    @property
    def width(self) -> int:
        """Number of parameters of the measurement: the passive stiffness, and those that are free."""
        return len(self.prior.operator.parameters)

    @property
    def counts_beside(self) -> bool:
        """Whether pressures are part of the likelihood."""
        return self.informed

    def points(self, phi: FloatArray) -> FloatArray:
        """Return the hearts (n, k) of phi (n, d)."""
        return self.prior.heart(phi)

    def completed(self, points: FloatArray, scores: FloatArray) -> FloatArray:
        """Return phi (n, d) of hearts (n, k) and scores (n, o)."""
        return completed_heart(points, scores, self.prior)

    def simulated(self, points: FloatArray) -> tuple[WallPhases, FloatArray]:
        """Return the wall of hearts (n, k), and the log density of the pressures of their beats, (n,)."""
        phi = self.completed(points, np.zeros((len(points), self.width)))
        if self.pressures is None:
            return self.speeds.wall(phi), np.zeros(len(points))
        return self.pressures.wall_and_density(phi)

    def log_likelihood_of(self, points: FloatArray, simulated: WallPhases, scores: FloatArray) -> FloatArray:
        """Return log p(speeds | heart, scores), -inf where the simulation failed; shape (n,)."""
        predicted = self.speeds.predict_at(self.completed(points, scores), simulated)
        return self.speeds.log_likelihood_of(predicted)

    def linear(self, simulated: WallPhases, scores: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return log speeds less their predictions (n, p), and the slopes of these (n, p, o)."""
        return linear_speeds(self.speeds, simulated, scores)

    def errors(self, points: FloatArray, simulated: WallPhases, scores: FloatArray) -> Errors | CellErrors:
        """Return the errors of the log speeds at these scores."""
        errors = self.speeds.errors_of(self.speeds.predict_at(self.completed(points, scores), simulated))
        return replace(errors, sd=np.where(np.isfinite(errors.sd), errors.sd, 1.0))

    def standardised(self, points: FloatArray) -> FloatArray:
        """Return residuals and scores at the mode of the scores, of hearts (n, k); (n, p + o), NaN: failed.

        Their sum of squares is -2 log of the posterior of the scores at its mode, but for a constant.
        """
        wall, _ = self.simulated(points)
        mode = self.conditional(points, wall).mode
        z = self.speeds.standardised_of(self.speeds.predict_at(self.completed(points, mode), wall))
        return np.hstack([z, mode])


def completed_heart(heart: FloatArray, scores: FloatArray, prior: JointPriorSettings) -> FloatArray:
    """Return phi (n, d) of hearts (n, k) and the normal scores (n, o) of what measures them."""
    theta, physiology = heart[:, OF_THETA], heart[:, OF_THETA.stop :]
    return prior.joined(theta, physiology, of_scores(scores, prior.operator))


def linear_speeds(speeds: SpeedModel, wall: WallPhases, scores: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return measured log speeds less those of walls at scores (n, o), and the slopes of the latter.

    With E = a r^x m^(4 x (1 - x)) + E_act, log c = log q + 1/2 log(E / 3 rho) (``predict_speeds``).
    """
    own: OperatorPrior = speeds.settings.prior.operator
    log_values, log_slopes = log_of_scores(scores, own)
    x = wall.shortening
    log_passive, log_scale, along = np.zeros_like(x), np.zeros_like(x), []
    powers = dict.fromkeys((own.names[0], SCALE), np.ones_like(x))
    powers |= {"passive_ratio": x, "passive_middle_factor": 4.0 * x * (1.0 - x)}
    for name, log_value in zip(own.names, log_values.T, strict=True):
        direction = powers[name]  # an error for a nuisance whose slope is not written down here
        if name == SCALE:
            log_scale = log_scale + log_value[:, None]
        else:
            log_passive = log_passive + log_value[:, None] * direction
        along.append(direction)
    passive = np.exp(log_passive)
    stiffness = np.maximum(passive + wall.active_kpa, LEAST_STIFFNESS_KPA)
    share = 0.5 * passive / stiffness
    slopes = [each if name == SCALE else share * each for name, each in zip(own.names, along, strict=True)]
    log_speed = log_scale + 0.5 * np.log(squared_speed_m2_s2(stiffness, speeds.settings.density_kg_m3))
    distance = np.nan_to_num(np.log(speeds.recording.speed_m_s) - log_speed)
    return distance, np.nan_to_num(np.stack(slopes, axis=2) * log_slopes[:, None])
