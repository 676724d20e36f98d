"""Prior and posterior predictive checks of one subject."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.evaluation.features import FeatureCheck, check_features
from swesbi.evaluation.scores import NO_SCORES, Band, Scores, band, coverage, score

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Draws:
    """n successful simulations: parameters, curves as measured, and what a cardiologist reads.

    Attributes:
        theta: (n, 3) parameters, in the order of ``THETA_NAMES``.
        curve_kpa: (n, grid) total stiffness through the measurement operator.
        phase_kpa: (n, phases) total stiffness at the phases of the recording.
        features: (n, features) checked features of ``curve_kpa``.
        end_diastolic_volume_ml: (n,) largest cavity volume of the simulated beat.
        end_systolic_volume_ml: (n,) its smallest cavity volume.
        attained_stiffness_kpa: (n,) active stiffness k_0 (1 - exp(-k_ATP D_T)) reached by the activation D_T.
        failed: Draws left out because their simulation failed.
    """

    theta: FloatArray
    curve_kpa: FloatArray
    phase_kpa: FloatArray
    features: FloatArray
    end_diastolic_volume_ml: FloatArray
    end_systolic_volume_ml: FloatArray
    attained_stiffness_kpa: FloatArray
    failed: int

    @property
    def ejection_fraction(self) -> FloatArray:
        """Ejection fraction of the simulated beat, shape (n,)."""
        return 1.0 - self.end_systolic_volume_ml / self.end_diastolic_volume_ml


@dataclass(frozen=True)
class Target:
    """The observation that predictions are compared with.

    Attributes:
        grid: (grid,) analysis phases.
        curve_kpa: (grid,) observed curve.
        phase: (phases,) phases of the recording.
        measured: (phases,) False where the phase is missing.
        stiffness_kpa: (phases,) stiffness, NaN where missing.
        stiffness_se_kpa: (phases,) its standard error, NaN where missing.
        features: (features,) checked features of the observed curve.
        feature_names: Their names.
        feature_noise_sd: (features,) observation noise of each, same units.
        lvedv_ml: Measured end-diastolic volume, from the subject's context.
        lvesv_ml: Measured end-systolic volume; it conditions the posterior, the simulator does not see it.
    """

    grid: FloatArray
    curve_kpa: FloatArray
    phase: FloatArray
    measured: NDArray[np.bool_]
    stiffness_kpa: FloatArray
    stiffness_se_kpa: FloatArray
    features: FloatArray
    feature_names: tuple[str, ...]
    feature_noise_sd: FloatArray
    lvedv_ml: float
    lvesv_ml: float


@dataclass(frozen=True)
class Prediction:
    """A predictive distribution (prior or posterior) and how it meets the observation.

    Attributes:
        draws: The simulations.
        curve: Median and interval of the curves on the grid.
        phases: Median and interval at the phases of the recording.
        features: The checked features, observation noise included.
        scores: On the grid.
        phase_scores: On the measured phases.
        coverage_recording_noise: Fraction of the measured phases inside the interval of a new
            recording: stiffness plus Gaussian noise of the recording's standard error.
    """

    draws: Draws
    curve: Band
    phases: Band
    features: FeatureCheck
    scores: Scores
    phase_scores: Scores
    coverage_recording_noise: float


@dataclass(frozen=True)
class PredictiveCheck:
    """The prior and the posterior predictive check of one subject.

    A subject outside the prior's support has a posterior prediction of 0 draws, NaN throughout.
    ``interval`` is the probability mass of every interval.
    """

    target: Target
    interval: float
    supported: bool
    prior: Prediction
    posterior: Prediction


def predict(draws: Draws, target: Target, interval: float, rng: np.random.Generator) -> Prediction:
    """Compare predictive draws with the observation.

    Args:
        draws: n simulations; with n = 0 every score and band is NaN.
        target: The observation.
        interval: Probability mass of the central intervals.
        rng: Draws the observation noise of features and phases.
    """
    curve, phases = band(draws.curve_kpa, interval), band(draws.phase_kpa, interval)
    features = check_features(target.features, draws.features, target.feature_noise_sd, interval, rng)
    measured = target.measured
    at_phases = Band(phases.median[measured], phases.low[measured], phases.high[measured])
    return Prediction(
        draws=draws,
        curve=curve,
        phases=phases,
        features=features,
        scores=score(target.grid, target.curve_kpa, curve),
        phase_scores=score(target.phase[measured], target.stiffness_kpa[measured], at_phases),
        coverage_recording_noise=_noisy_coverage(draws, target, interval, rng),
    )


def _noisy_coverage(draws: Draws, target: Target, interval: float, rng: np.random.Generator) -> float:
    if len(draws.phase_kpa) == 0:
        return NO_SCORES.coverage
    values = draws.phase_kpa[:, target.measured]
    noise = rng.standard_normal(values.shape) * target.stiffness_se_kpa[target.measured]
    return coverage(target.stiffness_kpa[target.measured], band(values + noise, interval))
