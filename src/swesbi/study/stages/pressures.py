"""Answers with the pressures of a cuff, beside those on the speeds alone."""

from __future__ import annotations

import logging
from pathlib import Path

from swesbi.artefacts import save
from swesbi.base.settings import Settings
from swesbi.heart.physiology import VOLUME_FACTOR
from swesbi.measurement.clinical import ClinicalModel, with_pressures
from swesbi.measurement.likelihood import build_speed_model
from swesbi.measurement.settings import ClinicalSettings
from swesbi.networks.flow.files import load_flow
from swesbi.networks.flow.flow import FlowProposal, flow_proposal
from swesbi.posterior.exact import exact_posterior, exact_to_groups
from swesbi.posterior.extended import extended_proposal
from swesbi.posterior.truncated import POSTERIOR
from swesbi.recording.noise import read_noise
from swesbi.recording.observation import read_observation
from swesbi.study.stages.exact import ExactPosteriorStageSettings
from swesbi.study.stages.origin import Origin

LOGGER = logging.getLogger("swesbi")
STREAM = "pressures"


class PressuresStageSettings(Settings):
    """What a posterior with pressures depends on."""

    exact_posterior: ExactPosteriorStageSettings
    clinical: ClinicalSettings


def pressures(
    *,
    observation: Path,
    noise: Path,
    estimator: Path,
    posterior: Path,
    settings: PressuresStageSettings,
    origin: Origin,
) -> None:
    """Infer a subject from speeds and cuff pressures, by the network of a population.

    Args:
        observation: Observed curve, with pressures.
        noise: Noise of the cohort.
        estimator: The network.
        posterior: Output.

    Raises:
        ArtefactError: An input is no such artefact.
        NoLikelihoodError: Every simulation fails.
        ValueError: The subject has no pressures.
    """
    flow, components = load_flow(estimator)[0], read_noise(noise).components
    speeds = build_speed_model(observation, components, settings.exact_posterior.model)
    model = with_pressures(speeds, read_observation(observation).clinical, settings.clinical)
    network = flow_proposal(flow, speeds.recording)
    infer_with_pressures(model, network, posterior, settings, origin, STREAM)


def infer_with_pressures(
    model: ClinicalModel,
    network: FlowProposal,
    posterior: Path,
    settings: PressuresStageSettings,
    origin: Origin,
    stream: str,
) -> None:
    """Write the exact posterior of a recording with its pressures.

    The network knows nothing of the stressed volume, so its draws get one from the prior; what the two have
    to do with each other is left to the rounds.

    Args:
        model: The recording's.
        network: What the network makes of its speeds.
        posterior: Output.
        settings: Stored with it.
        origin: Seed, subject and code.
        stream: Begins the name of its random streams.

    Raises:
        NoLikelihoodError: The likelihood is zero at every draw of a round.
    """
    prior, exact_settings = model.settings.prior, settings.exact_posterior.exact
    proposal = extended_proposal(network, prior, VOLUME_FACTOR)
    streams = (origin.seed, stream, "pressures", origin.subject)
    exact, efficiency = exact_posterior(model, proposal, exact_settings, *streams)
    groups = exact_to_groups(exact, network.condition, network.flow.components, prior, exact_settings)
    save(posterior, groups, origin.provenance(POSTERIOR, settings))
    LOGGER.info(
        "subject %s with pressures: draws by %s; k-hat %.2f, efficiency by round %s",
        origin.subject, exact.sampler, exact.k_hat, ", ".join(f"{share:.0%}" for share in efficiency),
    )  # fmt: skip
    for reason in exact.reasons:
        LOGGER.log(logging.INFO if exact.converged else logging.WARNING, "  %s", reason)
