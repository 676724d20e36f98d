"""Prior and posterior predictive checks of one subject, on features or on measured speeds."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.random import Generator

from swesbi.artefacts import ArtefactError, save
from swesbi.base import Settings
from swesbi.checks.draws import SubjectModel, from_prior, from_theta
from swesbi.checks.draws import make_target as target_of_features
from swesbi.checks.predictive import KIND, PredictiveCheck, predict, to_datasets
from swesbi.checks.predictive_speeds import (
    Recorder,
    feature_noise_sd,
    posterior_recordings,
    predict_recordings,
    prior_recordings,
    withheld,
)
from swesbi.checks.predictive_speeds import make_target as target_of_recordings
from swesbi.checks.settings import PredictiveSettings
from swesbi.heart.settings import ForwardModelSettings
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.measurement.operator import read_passive
from swesbi.measurement.settings import MeasurementSettings, SummarySettings
from swesbi.measurement.subjects import read_speed_model
from swesbi.networks.settings import ObservationModelSettings
from swesbi.posterior.result import read_exact_result
from swesbi.posterior.truncated import read_posterior
from swesbi.recording.observation import read_observation
from swesbi.seeds import generator
from swesbi.simulations import PriorSimulations, read_simulations
from swesbi.study.stages.origin import Origin
from swesbi.verdict.support import read_support

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
    support: Path,
    observation: Path,
    passive: Path,
    shards: Sequence[Path],
    predictive: Path,
    settings: PredictiveStageSettings,
    origin: Origin,
) -> None:
    """Write the predictive checks of one subject; a subject outside the prior's support has no posterior."""
    model = SubjectModel(
        read_observation(observation), read_passive(passive), settings.forward_model, settings.measurement
    )
    names, number = settings.predictive.features, settings.predictive.draws
    supported = read_support(support).supported
    theta = read_posterior(posterior).theta[: number if supported else 0]
    draws = {
        "prior": from_prior(read_simulations(shards), model, names, settings.summary, number),
        "posterior": from_theta(theta, model, names, settings.summary),
    }
    target = target_of_features(model, names, settings.summary, settings.observation_model)
    predictions = {
        name: predict(part, target, settings.predictive.interval, _stream(origin, name))
        for name, part in draws.items()
    }
    check = PredictiveCheck(target, settings.predictive.interval, supported, **predictions)
    save(predictive, to_datasets(check), origin.provenance(KIND, settings))
    _log(model.observation.subject, check)


def _stream(origin: Origin, name: str) -> Generator:
    return generator(origin.seed, "predictive", origin.subject, name)


def _log(subject: str, check: PredictiveCheck) -> None:
    prior, posterior = check.prior.scores, check.posterior.scores
    if not check.supported:
        LOGGER.info("subject %s: no posterior; prior RMSE %.2f kPa", subject, prior.rmse_kpa)
        return
    LOGGER.info(
        "subject %s: RMSE %.2f -> %.2f kPa, R2 %.3f, coverage %.2f, %d/%d features inside, %d draws failed",
        subject,
        prior.rmse_kpa,
        posterior.rmse_kpa,
        posterior.r2,
        posterior.coverage,
        check.posterior.features.inside.sum(),
        len(check.target.feature_names),
        check.posterior.draws.failed,
    )


class PredictiveSpeedsStageSettings(Settings):
    """What a predictive check depends on."""

    model: SpeedModelSettings
    summary: SummarySettings
    predictive: PredictiveSettings


def predictive_speeds(
    *,
    posterior: Path,
    support: Path,
    observation: Path,
    noise: Path,
    shards: Sequence[Path],
    predictive: Path,
    settings: PredictiveSpeedsStageSettings,
    origin: Origin,
) -> None:
    """Write the predictive checks of one subject.

    New recordings are drawn under the whole observation model: measurement noise and discrepancy. An
    unsupported subject keeps its predictive curves, which show what the model cannot do, but has no scores.

    Raises:
        ArtefactError: Every posterior draw failed in the simulator, or a file cannot be read.
    """
    recorder = Recorder(
        read_speed_model(observation, noise, settings.model),
        read_observation(observation),
        settings.predictive.features,
        settings.summary,
    )
    write_check(posterior, support, predictive, recorder, read_simulations(shards), settings, origin)


def write_check(
    posterior: Path,
    support: Path,
    predictive: Path,
    recorder: Recorder,
    simulations: PriorSimulations,
    settings: PredictiveSpeedsStageSettings,
    origin: Origin,
) -> None:
    """Write the predictive checks of the recorder's recording, with these simulations of its prior.

    Raises:
        ArtefactError: Every posterior draw failed in the simulator, or a file cannot be read.
    """
    number, interval = settings.predictive.draws, settings.predictive.interval
    answered = read_support(support).supported
    phi = read_exact_result(posterior).phi[:number]
    prior = prior_recordings(simulations, number, recorder, _stream_of_speeds(origin, "prior"))
    after = posterior_recordings(phi, recorder, _stream_of_speeds(origin, "posterior"))
    if not len(after.draws.theta):
        raise ArtefactError(f"{posterior}: none of {len(phi)} draws can be simulated; delete it and rerun")
    target = target_of_recordings(recorder, feature_noise_sd(after))
    found = predict_recordings(after, target, interval)
    check = PredictiveCheck(
        target=target,
        interval=interval,
        supported=answered,
        prior=predict_recordings(prior, target, interval),
        posterior=found if answered else withheld(found),
    )
    save(predictive, to_datasets(check), origin.provenance(KIND, settings))
    _log_speeds(origin.subject, check)


def _stream_of_speeds(origin: Origin, name: str) -> np.random.Generator:
    return generator(origin.seed, "predictive speeds", origin.subject, name)


def _log_speeds(subject: str, check: PredictiveCheck) -> None:
    prior, posterior = check.prior.scores, check.posterior.scores
    if not check.supported:
        LOGGER.info("subject %s: unsupported, no scores; prior RMSE %.2f kPa", subject, prior.rmse_kpa)
        return
    LOGGER.info(
        "subject %s: RMSE %.2f -> %.2f kPa, R2 %.3f, coverage %.2f of the grid, %.2f of the phases",
        subject,
        prior.rmse_kpa,
        posterior.rmse_kpa,
        posterior.r2,
        posterior.coverage,
        check.posterior.phase_scores.coverage,
    )
