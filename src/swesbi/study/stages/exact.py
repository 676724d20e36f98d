"""Exact posteriors: of one subject, of recordings of known parameters."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np

from swesbi.answers.answer import log_certificate
from swesbi.answers.settings import ExactPosteriorSettings
from swesbi.artefacts import Origin, save
from swesbi.base.settings import Settings
from swesbi.checks.calibration.dataset import RECORDINGS_KIND, recordings_dataset
from swesbi.checks.calibration.ranks import Inferred
from swesbi.checks.calibration.recordings import infer_recordings
from swesbi.checks.calibration.settings import RecordingsSettings
from swesbi.measurement import likelihood
from swesbi.measurement.speeds import measured_speeds
from swesbi.networks.flow.files import load_flow
from swesbi.networks.flow.flow import flow_proposal
from swesbi.population.synthetic import Acquisition, acquired_recordings, own_recordings
from swesbi.posterior import exact as posteriors
from swesbi.posterior.exact import conditioned
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.result import exact_to_groups
from swesbi.posterior.settings import ExactSettings
from swesbi.posterior.truncated import POSTERIOR
from swesbi.recording.acquisition_settings import AcquisitionSettings
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents

LOGGER = logging.getLogger("swesbi")
STREAM = "calibration"


def exact_posterior(
    *,
    observation: Path,
    noise: Path,
    estimator: Path,
    posterior: Path,
    settings: ExactPosteriorSettings,
    origin: Origin,
) -> None:
    """Weight the network's draws with the simulator; where the weights fail, sample by MCMC.

    A sampler that does not converge leaves its draws and says so, in the artefact and in the log.

    Raises:
        ArtefactError: An input is no such artefact.
        NoLikelihoodError: Every simulation fails.
    """
    model, (flow, _) = likelihood.read_speed_model(observation, noise, settings.model), load_flow(estimator)
    proposal = flow_proposal(flow, model.recording)
    exact, efficiency = posteriors.exact_posterior(
        HeartModel(model), proposal, settings.exact, origin.seed, "exact", model.recording.subject
    )
    rounds = ", ".join(f"{share:.0%}" for share in efficiency)
    LOGGER.info("efficiency of the network, and of all draws after each further round: %s", rounds)
    log_certificate(origin.subject, exact)
    groups = exact_to_groups(conditioned(exact, proposal), settings.model.prior)
    save(posterior, groups, origin.provenance(POSTERIOR, settings))


class CalibrationRecordingsStageSettings(Settings):
    """What the recordings and their posteriors depend on."""

    model: likelihood.SpeedModelSettings
    exact: ExactSettings
    acquisition: AcquisitionSettings
    recording: RecordingSettings
    recordings: RecordingsSettings


def calibration_recordings(
    *,
    observation: Path,
    noise: Path,
    estimator: Path,
    recordings: Path,
    settings: CalibrationRecordingsStageSettings,
    origin: Origin,
) -> None:
    """Make recordings in the subject's context and with its phases, and infer every one.

    Half of the runs have the model's own noise and discrepancy. The others start from the same phi but are
    acquired sample by sample, with the discrepancy drawn for each phase, pass quality control and ingestion,
    get their standard errors from the cohort's variance components and their own counts, and have their own
    phases; the passive stiffness is inferred with the rest. Recordings that ingestion refuses are left out,
    and the log says how many.

    Raises:
        ArtefactError: An input is no such artefact.
        ValueError: Ingestion refused every recording.
    """
    observed = Observation.read(observation)
    components = CohortNoise.read(noise).of(observed.subject)
    model = likelihood.SpeedModel(measured_speeds(observed, components), settings.model)
    flow, _ = load_flow(estimator)
    sizes, subject = settings.recordings, observed.subject
    own = own_recordings(model, sizes.own, origin.seed, STREAM)
    acquisition = acquisition_of(observed, components, settings)
    acquired = acquired_recordings(model, acquisition, sizes.acquired, origin.seed, STREAM)
    LOGGER.info("%s: ingestion refused %d of %d recordings", subject, acquired.refused, sizes.acquired)
    if not len(acquired.phi):
        raise ValueError(f"subject {subject}: all {sizes.acquired} synthetic recordings were refused")
    groups = {}
    for name, synthetic in (("own", own), ("acquired", acquired)):
        inferred = infer_recordings(model, synthetic, flow, sizes, settings.exact, origin.seed, name)
        LOGGER.info("%s, %s: %s", subject, name, _account(inferred))
        groups[name] = recordings_dataset(inferred)
    save(recordings, groups, origin.provenance(RECORDINGS_KIND, settings))


def acquisition_of(
    observed: Observation, noise: NoiseComponents, settings: CalibrationRecordingsStageSettings
) -> Acquisition:
    """Return how recordings like the subject's are made: with the errors of its group."""
    missing = tuple(int(index) for index in observed.phase_index[~observed.measured])
    errors = {
        "sample_sd_fraction": noise.sample_fraction,
        "repeat_sd_fraction": noise.repeat_fraction,
        "sweep_fraction": noise.sweep_fraction,
    }
    acquisition = settings.acquisition.model_copy(update=errors)
    return Acquisition(acquisition, settings.recording, settings.model.measurement, noise, missing)


def _account(inferred: Inferred) -> str:
    diagnostics = inferred.diagnostics
    return (
        f"efficiency {np.median(diagnostics.efficiency):.0%} (median), "
        f"k-hat at most {diagnostics.k_hat.max():.2f}, "
        f"MCMC took over in {int(diagnostics.by_mcmc.sum())} of {len(diagnostics.by_mcmc)}"
    )
