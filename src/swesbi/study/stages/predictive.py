"""Prior and posterior predictive checks of one subject, on features or on measured speeds."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from swesbi.answers.settings import PredictiveSpeedsSettings
from swesbi.artefacts import Origin, save
from swesbi.artefacts.typed import read_as
from swesbi.base.arrays import FloatArray
from swesbi.base.settings import Settings
from swesbi.checks.draws import CheckedFeatures, FeatureModel, make_target
from swesbi.checks.predictive import (
    KIND,
    Draws,
    Prediction,
    PredictiveCheck,
    noise_streams,
    observe,
    predict,
    to_datasets,
)
from swesbi.checks.predictive_speeds import Recorder, predictive_check, prior_recordings, stream_of
from swesbi.checks.settings import PredictiveSettings
from swesbi.heart.prior_simulations import PriorSimulations
from swesbi.heart.settings import ForwardModelSettings
from swesbi.measurement.likelihood import MeasuredSubject, read_speed_model
from swesbi.measurement.operator import PassiveBaseline
from swesbi.measurement.settings import MeasurementSettings, SummarySettings, summary_names
from swesbi.networks.paper.pool import noise_sd
from swesbi.networks.settings import ObservationModelSettings
from swesbi.parameters import THETA
from swesbi.posterior.result import read_exact_posterior
from swesbi.posterior.truncated import read_posterior
from swesbi.recording.observation import Observation
from swesbi.verdict.verdict import read_verdict

LOGGER = logging.getLogger("swesbi")


class PredictiveStageSettings(Settings):
    """What a predictive check depends on."""

    predictive: PredictiveSettings
    forward_model: ForwardModelSettings
    measurement: MeasurementSettings
    summary: SummarySettings
    observation_model: ObservationModelSettings


def predictive(
    *,
    posterior: Path,
    verdict: Path,
    observation: Path,
    passive: Path,
    shards: Sequence[Path],
    predictive: Path,
    settings: PredictiveStageSettings,
    origin: Origin,
) -> None:
    """Write the predictive checks of one subject; a subject outside the prior's support has no posterior.

    The noise that the observation model puts back on curves has a stream of its own.
    """
    subject = MeasuredSubject(
        Observation.read(observation), PassiveBaseline.read(passive), settings.measurement
    )
    readable = read_verdict(verdict).may_be_read
    theta = read_posterior(posterior).theta if readable else np.empty((0, len(THETA)))
    check = checked(
        subject,
        read_as(PriorSimulations, shards, "shards"),
        theta,
        settings,
        origin.seed,
        may_be_read=readable,
    )
    write_check(predictive, check, settings, origin)


def checked(
    subject: MeasuredSubject,
    simulations: PriorSimulations,
    theta: FloatArray,
    settings: PredictiveStageSettings,
    seed: int,
    *,
    may_be_read: bool,
) -> PredictiveCheck:
    """Return the predictive checks of one subject, from its prior's simulations and its posterior's draws.

    Args:
        subject: The recording, with its passive baseline.
        simulations: Of its prior.
        theta: Draws of its posterior; shape (n, 3), n may be 0.
        settings: Of the check; so many draws are taken of each as they say.
        seed: Of the noise.
        may_be_read: Whether the prior supports the subject.
    """
    features = CheckedFeatures(settings.predictive.features, settings.summary)
    model = FeatureModel(subject, settings.forward_model, features)
    number, noise = settings.predictive.draws, settings.observation_model.feature_noise_sd
    sd = noise_sd(summary_names(settings.summary), noise)
    recording = subject.observation
    target = make_target(recording, features, recording.stiffness_se_kpa, sd[features.columns])

    def predicted(name: str, draws: Draws) -> Prediction:
        of_curves, of_values = noise_streams(seed, recording.subject, name)
        observed = observe(draws, target.phase, noise, of_curves)
        return predict(draws, observed, target, settings.predictive.interval, of_values)

    prior = predicted("prior", model.from_prior(simulations, number))
    posterior = predicted("posterior", model.from_theta(theta[:number]))
    return PredictiveCheck(target, settings.predictive.interval, may_be_read, prior, posterior)


def write_check(path: Path, check: PredictiveCheck, settings: Settings, origin: Origin) -> None:
    """Write a predictive check, and log its scores."""
    save(path, to_datasets(check), origin.provenance(KIND, settings))
    prior, posterior = check.prior.scores, check.posterior.scores
    if not check.may_be_read:
        LOGGER.info(
            "subject %s: not to be read, no scores; prior RMSE %.2f kPa", origin.subject, prior.rmse_kpa
        )
        return
    LOGGER.info(
        "subject %s: RMSE %.2f -> %.2f kPa, R2 %.3f, coverage of the grid by noiseless curves %.2f, "
        "with noise %.2f (prior without %.2f, its envelope %.2f), %d/%d features inside, %d draws failed",
        origin.subject,
        prior.rmse_kpa,
        posterior.rmse_kpa,
        posterior.r2,
        check.posterior.coverages.noiseless,
        check.posterior.coverages.observed,
        check.prior.coverages.noiseless,
        check.prior.coverages.envelope,
        check.posterior.features.inside.sum(),
        len(check.target.feature_names),
        check.posterior.draws.failed,
    )


def predictive_speeds(
    *,
    posterior: Path,
    verdict: Path,
    observation: Path,
    noise: Path,
    shards: Sequence[Path],
    predictive: Path,
    settings: PredictiveSpeedsSettings,
    origin: Origin,
) -> None:
    """Write the predictive checks of one subject in an experiment on speeds.

    Raises:
        ArtefactError: A file cannot be read.
        ValueError: Every posterior draw failed in the simulator.
    """
    recorder = Recorder(
        read_speed_model(observation, noise, settings.model),
        Observation.read(observation),
        CheckedFeatures(settings.predictive.features, settings.summary),
    )
    number, rng = settings.predictive.draws, stream_of(recorder, origin.seed, "prior")
    check = predictive_check(
        recorder,
        read_exact_posterior(posterior).phi,
        prior_recordings(read_as(PriorSimulations, shards, "shards"), number, recorder, rng),
        settings.predictive,
        origin.seed,
        may_be_read=read_verdict(verdict).may_be_read,
    )
    write_check(predictive, check, settings, origin)
