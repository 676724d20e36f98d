"""Stage: the prior and posterior predictive checks of one subject."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from numpy.random import Generator

from swesbi.artefacts import save
from swesbi.evaluation.draws import from_prior, from_theta, make_target
from swesbi.evaluation.predictive import PredictiveCheck, predict
from swesbi.evaluation.predictive_dataset import KIND, to_datasets
from swesbi.evaluation.settings import PredictiveSettings
from swesbi.evaluation.subject_model import SubjectModel
from swesbi.forward_model.settings import ForwardModelSettings
from swesbi.inference.dataset import read_posterior
from swesbi.inference.settings import ObservationModelSettings
from swesbi.inference.support import read_support
from swesbi.observation.dataset import read_passive
from swesbi.observation.settings import MeasurementSettings, SummarySettings
from swesbi.recording.dataset import read_observation
from swesbi.seeds import generator
from swesbi.settings import Settings
from swesbi.simulations.dataset import read_simulations
from swesbi.stages.origin import Origin

LOGGER = logging.getLogger("swesbi")


class PredictiveStageSettings(Settings):
    """What a predictive check depends on."""

    predictive: PredictiveSettings
    forward_model: ForwardModelSettings
    measurement: MeasurementSettings
    summary: SummarySettings
    observation_model: ObservationModelSettings


def run(
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
    target = make_target(model, names, settings.summary, settings.observation_model)
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
