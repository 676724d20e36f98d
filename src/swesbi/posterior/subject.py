"""The exact posterior of a subject of the study, by the network of an experiment."""

from __future__ import annotations

import logging

from swesbi.measurement.likelihood import SpeedModelSettings, speed_model
from swesbi.networks.flow.flow import flow_proposal
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.posterior.exact import described, exact_posterior, log_certificate
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import ExactSettings
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation

LOGGER = logging.getLogger("swesbi")


def posterior_of_subject(
    observation: Observation,
    noise: CohortNoise,
    estimator: TrainedFlow,
    *,
    model: SpeedModelSettings,
    exact: ExactSettings,
    seed: int,
) -> ExactPosterior:
    """Weight the network's draws with the simulator; where the weights fail, sample by MCMC.

    A sampler that does not converge leaves its draws and says so, in the artefact and in the log.

    Raises:
        NoLikelihoodError: Every simulation fails.
    """
    recorded, subject = speed_model(observation, noise, model), observation.subject
    network = flow_proposal(estimator, recorded.recording)
    found, efficiency = exact_posterior(HeartModel(recorded), network, exact, seed, "exact", subject)
    rounds = ", ".join(f"{share:.0%}" for share in efficiency)
    LOGGER.info("efficiency of the network, and of all draws after each further round: %s", rounds)
    log_certificate(subject, found)
    return described(found, model.prior, network)
