"""Predictive checks of an experiment on features."""

from __future__ import annotations

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.checks.draws import CheckedFeatures, FeatureModel, make_target
from swesbi.checks.predictive import (
    Draws,
    Prediction,
    PredictiveCheck,
    log_scores,
    noise_streams,
    observe,
    predict,
)
from swesbi.checks.settings import PredictiveSettings
from swesbi.heart.prior_simulations import PriorSimulations
from swesbi.heart.settings import ForwardModelSettings
from swesbi.measurement.likelihood import MeasuredSubject
from swesbi.measurement.operator import PassiveBaseline
from swesbi.measurement.settings import MeasurementSettings, SummarySettings, summary_names
from swesbi.networks.paper.pool import noise_sd
from swesbi.networks.settings import ObservationModelSettings
from swesbi.parameters import THETA
from swesbi.posterior.truncated import Posterior
from swesbi.recording.observation import Observation
from swesbi.verdict.verdict import Verdict


def check_of_features(
    posterior: Posterior,
    verdict: Verdict,
    observation: Observation,
    passive: PassiveBaseline,
    shards: PriorSimulations,
    *,
    predictive: PredictiveSettings,
    forward_model: ForwardModelSettings,
    measurement: MeasurementSettings,
    summary: SummarySettings,
    observation_model: ObservationModelSettings,
    seed: int,
) -> PredictiveCheck:
    """Check the predictions of one subject; a subject outside the prior's support has no posterior.

    The noise that the observation model puts back on curves has a stream of its own.

    Args:
        posterior: Of the subject.
        verdict: Whether it may be read.
        observation: The recording.
        passive: Its passive baseline.
        shards: Simulations of the subject's prior.
        predictive: So many draws are taken of prior and posterior as it says.
        forward_model: Of the simulations.
        measurement: The measurement operator.
        summary: Which features.
        observation_model: The noise of features.
        seed: Of the noise.
    """
    features = CheckedFeatures(predictive.features, summary)
    subject = MeasuredSubject(observation, passive, measurement)
    model, noise = FeatureModel(subject, forward_model, features), observation_model.feature_noise_sd
    sd = noise_sd(summary_names(summary), noise)
    target = make_target(observation, features, observation.stiffness_se_kpa, sd[features.columns])

    def predicted(name: str, draws: Draws) -> Prediction:
        of_curves, of_values = noise_streams(seed, observation.subject, name)
        observed = observe(draws, target.phase, noise, of_curves)
        return predict(draws, observed, target, predictive.interval, of_values)

    theta: FloatArray = posterior.theta if verdict.may_be_read else np.empty((0, len(THETA)))
    check = PredictiveCheck(
        target,
        predictive.interval,
        verdict.may_be_read,
        predicted("prior", model.from_prior(shards, predictive.draws)),
        predicted("posterior", model.from_theta(theta[: predictive.draws])),
    )
    log_scores(observation.subject, check)
    return check
