"""The likelihood of speeds at any instants of the cycle, which share what the model misses.

Pushes lie at instants s_i, several of them as near to one another as one likes, so what the model misses is
not drawn anew for each. It is one in a cell of the cycle, as it is one at a gated phase: with log c(s) the
noiseless log speed, a push i in the cell b has

    log c_i = log c(s_i) + delta n_b + tau (d log c / ds)(s_i) m_b + lambda e_i,   n_b, m_b ~ N(0, 1),

and e_i ~ N(0, se_i^2) of its own, so that pushes of a cell have the covariance

    lambda^2 diag(se^2) + delta^2 1 1^T + tau^2 f f^T,   f_i = (d log c / ds)(s_i),

and those of different cells none. With one push a cell that is the variance of a gated phase
(``likelihood.log_speed_sd``). Nothing is averaged: of pushes of one instant and of equal, known errors the
mean of log c is sufficient, so that their likelihood is that of the mean in all but a factor without phi.

Where the errors are declared and not known, lambda is one factor of all of them with log lambda ~ N(0, v^2),
and the likelihood is the integral over it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import logsumexp

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.heart.simulate import Beats
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings
from swesbi.measurement.shared_error import Errors, Innovations
from swesbi.measurement.speeds import PredictedSpeeds, SpeedRecording, WallPhases
from swesbi.recording.free_observation import FreeObservation

WIDEST_STEP: Final = 0.25
NEWTON_STEPS: Final = 8
REACH: Final = 6.0  # standard deviations of log lambda to either side


def cell_innovations(
    distance: FloatArray,
    slope: FloatArray,
    se: FloatArray,
    cell: IntArray,
    speed_fraction: float,
    timing_cycle: float,
) -> Innovations:
    """Standardise n rows of p data, each datum given those before it in its row.

    The filter of ``shared_error``, with a state of two components (n_b, m_b) that begins anew in each cell
    and loadings (delta, tau f_i) that differ from row to row.

    Args:
        distance: Data less their means; shape (n, p).
        slope: d log c / ds of each row; shape (n, p).
        se: Standard deviations of the own errors; shape (n, p).
        cell: Cell of each datum, those of one side by side; shape (p,).
        speed_fraction: delta.
        timing_cycle: tau.
    """
    z, sd = np.empty_like(distance), np.empty_like(distance)
    first = np.concatenate([[True], cell[1:] != cell[:-1]])
    for i in range(len(cell)):
        if first[i]:
            mean_n, mean_m, cross = (np.zeros(len(distance)) for _ in range(3))
            var_n, var_m = np.ones(len(distance)), np.ones(len(distance))
        timing = timing_cycle * slope[:, i]
        gain_n = var_n * speed_fraction + cross * timing
        gain_m = cross * speed_fraction + var_m * timing
        sd[:, i] = np.sqrt(se[:, i] ** 2 + speed_fraction * gain_n + timing * gain_m)
        z[:, i] = (distance[:, i] - speed_fraction * mean_n - timing * mean_m) / sd[:, i]
        gain_n, gain_m = gain_n / sd[:, i], gain_m / sd[:, i]
        mean_n, mean_m = mean_n + gain_n * z[:, i], mean_m + gain_m * z[:, i]
        var_n, var_m, cross = var_n - gain_n**2, var_m - gain_m**2, cross - gain_n * gain_m
    return Innovations(z, sd)


def error_factors(log_sd: float, pushes: int) -> tuple[FloatArray, FloatArray]:
    """Return nodes lambda_k and log weights of the integral over lambda; (k,) each, one where it is known.

    The trapezium rule in u = log lambda / v over +-6. Of a normal density of standard deviation s it is off
    by 2 exp(-2 pi^2 s^2 / h^2) with steps of h (Trefethen and Weideman 2014, SIAM Review 56:385), 5e-9 with
    h = s. The information of p speeds on log lambda is 2 p at most, so s^2 >= 1 / (1 + 2 p v^2).

    Args:
        log_sd: v.
        pushes: p.
    """
    if log_sd == 0.0:
        return np.ones(1), np.zeros(1)
    step = min(WIDEST_STEP, 1.0 / np.sqrt(1.0 + 2.0 * pushes * log_sd**2))
    half = int(np.ceil(REACH / step))
    u = np.linspace(-REACH, REACH, 2 * half + 1)
    log_weight = -0.5 * u**2
    return np.exp(log_sd * u), log_weight - logsumexp(log_weight)


def likeliest_factor(chi_squared: FloatArray, pushes: int, log_sd: float) -> FloatArray:
    """Return the likeliest factor lambda of all errors, as if nothing else made them; shape (n,).

    It is where p u + chi^2 exp(-2 u) / 2 + u^2 / (2 v^2) is least, u = log lambda, by Newton's steps. The
    slope is concave in u, so they go to its root from below.

    Args:
        chi_squared: Sums of p squared residuals at a factor of one; shape (n,).
        pushes: p.
        log_sd: v.
    """
    u = np.zeros(len(chi_squared))
    if log_sd == 0.0:
        return np.ones_like(u)
    for _ in range(NEWTON_STEPS):
        misfit = chi_squared * np.exp(-2.0 * u)
        u = np.minimum(u - (pushes - misfit + u / log_sd**2) / (2.0 * misfit + log_sd**-2), REACH * log_sd)
    return np.asarray(np.exp(u))


@dataclass(frozen=True)
class FreeModel:
    """A free-running recording under the settings of an experiment on speeds.

    Attributes:
        model: What predicts the speeds at the instants of its p pushes; their errors are its own likelihood's
            alone where no two share a cell.
        cell: Cell of each push; shape (p,).
        noise_log_sd: v, of the factor of all errors; 0 where they are known.
    """

    model: SpeedModel
    cell: IntArray
    noise_log_sd: float

    @property
    def settings(self) -> SpeedModelSettings:
        """The settings of the model, its prior among them."""
        return self.model.settings

    @property
    def recording(self) -> SpeedRecording:
        """Its speeds and errors."""
        return self.model.recording

    def predict(self, phi: FloatArray) -> PredictedSpeeds:
        """Return the noiseless log speeds of phi (n, d), and their slopes; (n, p), NaN where it failed."""
        return self.model.predict(phi)

    def predict_from(self, phi: FloatArray, beats: Beats) -> PredictedSpeeds:
        """Return the same from simulated beats of phi."""
        return self.model.predict_from(phi, beats)

    def log_likelihood(self, phi: FloatArray) -> FloatArray:
        """Return log p(speeds | phi) of shape (n,); -inf where the simulation failed."""
        return self.log_likelihood_of(self.predict(phi))

    def log_likelihood_of(self, predicted: PredictedSpeeds) -> FloatArray:
        """Return the same of predicted speeds."""
        total = logsumexp(self.log_joint(predicted), axis=0)
        return np.where(np.isnan(total), -np.inf, total)

    def standardised(self, phi: FloatArray) -> FloatArray:
        """Return residuals of phi (n, d) by the median of the errors' factor; (n, p), NaN: failed."""
        return self.standardised_of(self.predict(phi))

    def standardised_of(self, predicted: PredictedSpeeds) -> FloatArray:
        """Return the same of predicted speeds."""
        return self.innovations(predicted).z

    def wall(self, phi: FloatArray) -> WallPhases:
        """Simulate phi (n, d) and return its wall at the instants; NaN where it failed."""
        return self.model.wall(phi)

    def predict_at(self, phi: FloatArray, wall: WallPhases) -> PredictedSpeeds:
        """Return the noiseless log speeds of simulations of phi (n, d) taken at the instants."""
        return self.model.predict_at(phi, wall)

    def errors_of(self, predicted: PredictedSpeeds) -> Errors:
        """Return the errors of the log speeds about n predictions, by their likeliest factor; NaN: failed."""
        missed, se = self.settings.discrepancy, self.recording.relative_se
        likeliest = likeliest_factor(
            self.innovations(predicted).chi_squared, len(self.cell), self.noise_log_sd
        )
        sd = np.hypot(likeliest[:, None] * se, missed.timing_cycle * predicted.slope)
        return Errors(sd, missed.speed_fraction * (self.cell[:, None] == np.unique(self.cell)))

    def log_joint(self, predicted: PredictedSpeeds) -> FloatArray:
        """Return log p(speeds | phi, lambda_k) with the log weight of the node lambda_k; shape (k, n)."""
        factors, log_weight = error_factors(self.noise_log_sd, len(self.cell))
        rows = [self.innovations(predicted, factor).log_density for factor in factors]
        return np.stack(rows) + log_weight[:, None]

    def draw_factor(self, predicted: PredictedSpeeds, rng: np.random.Generator) -> FloatArray:
        """Draw the factor of the errors given the recording and each of n simulations; shape (n,)."""
        factors, _ = error_factors(self.noise_log_sd, len(self.cell))
        joint = self.log_joint(predicted)
        below = np.cumsum(np.exp(joint - logsumexp(joint, axis=0)), axis=0) < rng.random(joint.shape[1])
        return np.asarray(factors[below.sum(axis=0).clip(max=len(factors) - 1)])

    def chi_squared(self, predicted: PredictedSpeeds, rng: np.random.Generator) -> FloatArray:
        """Return the sum of squared residuals of n simulations, each by a drawn factor of errors; (n,)."""
        return self.innovations(predicted, self.draw_factor(predicted, rng)).chi_squared

    def likeliest_residuals(self, predicted: PredictedSpeeds) -> FloatArray:
        """Return the standardised residuals of the likeliest of n simulations; (p,)."""
        best = np.array([int(np.argmax(logsumexp(self.log_joint(predicted), axis=0)))])
        return np.asarray(self.innovations(predicted.rows(best)).z[0])

    def draw_speeds(self, predicted: PredictedSpeeds, rng: np.random.Generator) -> FloatArray:
        """Draw the speeds (n, p) of new pushes at the recording's instants, one recording of each simulation.

        The factor of the errors is drawn from its posterior, where it is not known; what the model misses is
        one in each cell, as in the likelihood.
        """
        discrepancy, count = self.settings.discrepancy, len(predicted.log_speed)
        _, place = np.unique(self.cell, return_inverse=True)
        level, timing = rng.standard_normal((2, count, place.max() + 1))
        own = rng.standard_normal(predicted.log_speed.shape) * self.model.recording.relative_se
        missed = discrepancy.speed_fraction * level[:, place]
        missed = missed + discrepancy.timing_cycle * predicted.slope * timing[:, place]
        factor = self.draw_factor(predicted, rng)[:, None]
        return np.asarray(np.exp(predicted.log_speed + missed + factor * own))

    def innovations(self, predicted: PredictedSpeeds, factor: FloatArray | float = 1.0) -> Innovations:
        """Return the standardised residuals of n simulations, (n, p), errors times a factor of each, (n,)."""
        recording = self.model.recording
        distance = np.log(recording.speed_m_s) - predicted.log_speed
        se = np.reshape(factor, (-1, 1)) * recording.relative_se + np.zeros_like(distance)
        missed = self.settings.discrepancy
        return cell_innovations(
            distance, predicted.slope, se, self.cell, missed.speed_fraction, missed.timing_cycle
        )


def free_model(observed: FreeObservation, settings: SpeedModelSettings) -> FreeModel:
    """Build the model of a free-running recording.

    Raises:
        ValueError: A reference beat does not become periodic.
    """
    alone = np.empty((len(observed.phase), 0))
    recording = SpeedRecording(
        observed.context, observed.phase, observed.speed_m_s, observed.relative_se, alone
    )
    return FreeModel(SpeedModel(recording, settings), observed.cell, observed.noise_log_sd)
