"""Stage: the exact posterior of one subject in an experiment on speeds."""

from __future__ import annotations

import logging
from pathlib import Path

from swesbi.artefacts import save
from swesbi.exact.dataset import exact_to_groups
from swesbi.exact.posterior import ExactPosterior, exact_posterior
from swesbi.exact.proposal import FlowProposal, flow_proposal
from swesbi.exact.settings import ExactSettings
from swesbi.flow.files import load_flow
from swesbi.inference.dataset import POSTERIOR
from swesbi.seeds import integer_seed
from swesbi.settings import Settings
from swesbi.speed_model.model import SpeedModelSettings
from swesbi.speed_model.subjects import read_speed_model
from swesbi.stages.origin import Origin

LOGGER = logging.getLogger("swesbi")


class ExactPosteriorStageSettings(Settings):
    """What the exact posterior depends on, beside its input files."""

    model: SpeedModelSettings
    exact: ExactSettings


def run(
    *,
    observation: Path,
    noise: Path,
    estimator: Path,
    posterior: Path,
    settings: ExactPosteriorStageSettings,
    origin: Origin,
) -> None:
    """Weight the network's draws with the simulator; where the weights fail, sample by MCMC.

    A sampler that does not converge leaves its draws and says so, in the artefact and in the log.

    Raises:
        ArtefactError: An input is no such artefact.
        NoLikelihoodError: Every simulation fails.
    """
    model, (flow, _) = read_speed_model(observation, noise, settings.model), load_flow(estimator)
    proposal = flow_proposal(flow, model.recording)
    exact = exact_posterior(
        model, proposal, settings.exact, integer_seed(origin.seed, "exact", model.recording.subject)
    )
    write_posterior(posterior, exact, proposal, settings, origin)


def write_posterior(
    path: Path,
    exact: ExactPosterior,
    proposal: FlowProposal,
    settings: ExactPosteriorStageSettings,
    origin: Origin,
) -> None:
    """Write an exact posterior with the network's conditioning vector, and log how reliable it is."""
    components, prior = proposal.flow.components, settings.model.prior
    groups = exact_to_groups(exact, proposal.condition, components, prior, settings.exact)
    save(path, groups, origin.provenance(POSTERIOR, settings))
    _report(origin.subject, exact)


def _report(subject: str, exact: ExactPosterior) -> None:
    LOGGER.info(
        "subject %s: draws by %s; k-hat %.2f, efficiency %.0f %%",
        subject, exact.sampler, exact.k_hat, 100.0 * exact.efficiency,
    )  # fmt: skip
    level = logging.INFO if exact.converged else logging.WARNING
    for reason in exact.reasons:
        LOGGER.log(level, "  %s", reason)
