"""The likelihood of the measured speeds: independent normal log speeds with noise and discrepancy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swesbi.speed_model.prediction import PredictedSpeeds
from swesbi.speed_model.recording import SpeedRecording
from swesbi.speed_model.settings import DiscrepancySettings

FloatArray = NDArray[np.float64]


def log_speed_sd(
    predicted: PredictedSpeeds, relative_se: FloatArray, discrepancy: DiscrepancySettings
) -> FloatArray:
    """Return the standard deviation of the measured log speeds about the predicted ones; shape (n, p).

    sd^2 = se^2 + delta^2 + (tau d log c / ds)^2: the relative standard error of the mean speed, the
    model's relative error, and its error in phase carried over by the slope (first order in each).

    Args:
        predicted: Log speeds and slopes of n simulations.
        relative_se: Standard error over mean, at the p phases; shape (p,) or (n, p).
        discrepancy: delta and tau.
    """
    timing = discrepancy.timing_cycle * predicted.slope
    return np.asarray(np.sqrt(relative_se**2 + discrepancy.speed_fraction**2 + timing**2))


def residuals(
    predicted: PredictedSpeeds, recording: SpeedRecording, discrepancy: DiscrepancySettings
) -> FloatArray:
    """Return the standardised residuals (log c_obs - log c) / sd at the measured phases; shape (n, p)."""
    sd = log_speed_sd(predicted, recording.relative_se, discrepancy)
    return np.asarray((np.log(recording.speed_m_s) - predicted.log_speed) / sd)


def log_likelihood(
    predicted: PredictedSpeeds, recording: SpeedRecording, discrepancy: DiscrepancySettings
) -> FloatArray:
    """Return log p(log c_obs | phi) of n simulations at the measured phases; shape (n,).

    Simulations that failed (NaN) have likelihood zero.
    """
    sd = log_speed_sd(predicted, recording.relative_se, discrepancy)
    z = (np.log(recording.speed_m_s) - predicted.log_speed) / sd
    total = normal_log_density(z, np.log(sd)).sum(axis=1)
    return np.where(np.isnan(total), -np.inf, total)


def normal_log_density(z: FloatArray, log_sd: FloatArray) -> FloatArray:
    """Return the normal log density of data whose standardised residuals are z; of the data's shape."""
    return np.asarray(-0.5 * z**2 - log_sd - 0.5 * np.log(2.0 * np.pi))


def draw_speeds(
    predicted: PredictedSpeeds,
    relative_se: FloatArray,
    discrepancy: DiscrepancySettings,
    rng: np.random.Generator,
) -> FloatArray:
    """Draw one recording's speeds (n, p), in m/s, for each of n simulations."""
    sd = log_speed_sd(predicted, relative_se, discrepancy)
    return np.asarray(np.exp(predicted.log_speed + sd * rng.standard_normal(sd.shape)))
