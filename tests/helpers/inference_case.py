"""A linear-Gaussian case with a known posterior, shared by the tests of the inference.

log theta is normal (the prior's bounds lie 6 standard deviations away), the features are
x = A log theta + b plus Gaussian noise, so the posterior of log theta is normal and known.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import speed_case
from forward_model_cases import COHORT
from numpy.typing import NDArray

from swesbi.artefacts import values_of
from swesbi.context import Context
from swesbi.networks.paper.estimator import TrainedEstimator
from swesbi.networks.paper.pool import Components, Pool, SubjectFeatures, build_pool, components_of
from swesbi.networks.settings import EstimatorSettings, ObservationModelSettings
from swesbi.prior import PriorSettings, log_centre, quantile
from swesbi.seeds import generator

FloatArray = NDArray[np.float64]
FEATURES = ("one", "two", "three", "four")
NOISE_SD = (0.2, 0.3, 0.25, 0.3)
MIXING = np.array([[1.0, 0.5, 0.0], [0.0, 1.0, -0.5], [0.3, 0.0, 1.0], [1.0, 1.0, 1.0]])
LOG_SD = 0.4
OBSERVED = np.array([0.4, -0.3, 0.5, 0.1])

WIDE_PRIOR = PriorSettings.from_plain(
    {
        name: {
            "centre": centre,
            "log_sd": LOG_SD,
            "low": centre * float(np.exp(-6 * LOG_SD)),
            "high": centre * float(np.exp(6 * LOG_SD)),
        }
        for name, centre in (("k0_kpa", 45.0), ("k_atp_per_s", 5.0), ("k_sr_per_s", 30.0))
    }
)
PAPER_PRIOR = speed_case.shipped().priors["paper"]
OBSERVATION_MODEL = ObservationModelSettings(
    feature_noise_sd=dict(zip(FEATURES, NOISE_SD, strict=True)), augmentations=2
)
CONTEXTS = (COHORT["A"], COHORT["B"])


@dataclass(frozen=True)
class LogPosterior:
    """Normal posterior of log theta: mean (3,) and covariance (3, 3)."""

    mean: FloatArray
    covariance: FloatArray


def features_of(theta: FloatArray) -> FloatArray:
    return np.log(theta / log_centre(WIDE_PRIOR)) @ MIXING.T


def known_posterior(observed: FloatArray) -> LogPosterior:
    """Gaussian conditioning: precision = prior precision + A' N^-1 A."""
    weights = MIXING.T / np.square(NOISE_SD)
    covariance = np.linalg.inv(weights @ MIXING + np.eye(3) / LOG_SD**2)
    return LogPosterior(np.log(log_centre(WIDE_PRIOR)) + covariance @ weights @ observed, covariance)


def subject_features(context: Context, draws: int, observed: FloatArray, seed: int = 1) -> SubjectFeatures:
    theta = quantile(generator(seed, "test prior", context.subject).random((draws, 3)), WIDE_PRIOR)
    return SubjectFeatures(context, np.arange(draws), theta, features_of(theta), observed)


def weights(estimator: TrainedEstimator) -> dict[str, NDArray[np.float64]]:
    """Return the arrays of a network by name."""
    return values_of(estimator.net)["/"]


def components() -> Components:
    return components_of(FEATURES, ("kPa",) * len(FEATURES))


@cache
def pool_of_both(draws: int = 250) -> Pool:
    """Return the training set of both contexts, so many draws of each."""
    subjects = [subject_features(context, draws, OBSERVED) for context in CONTEXTS]
    return build_pool(subjects, components(), OBSERVATION_MODEL, seed=3)


def estimator_settings(**changes: object) -> EstimatorSettings:
    """Return the paper's estimator, small, with changes."""
    shipped = speed_case.shipped().experiments["paper"].estimator.to_plain()
    small = {"transforms": 2, "hidden_features": 16, "batch_size": 50, "max_num_epochs": 2}
    return EstimatorSettings.from_plain(shipped | small | {"procedure": "sbi"} | changes)
