"""Calibration in the context of one subject, and at its own data."""

from __future__ import annotations

import logging
from typing import Final

import numpy as np

from swesbi.artefacts import UnfitError
from swesbi.base.arrays import FloatArray
from swesbi.checks.calibration.dataset import CalibrationLocal, CalibrationRecordings
from swesbi.checks.calibration.local import calibrate_locally, classifier_accuracy
from swesbi.checks.calibration.ranks import NETWORK, WEIGHTED, InferredRecordings, TwoSamples
from swesbi.checks.calibration.recordings import infer_recordings
from swesbi.checks.calibration.settings import LocalSettings, RecordingsSettings
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, speed_model
from swesbi.measurement.settings import MeasurementSettings
from swesbi.networks.flow.flow import flow_proposal
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.population.recordings import MODEL_NOISE, SAMPLE_BY_SAMPLE, STREAMS
from swesbi.population.synthetic import Acquisition, acquired_recordings, own_recordings
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.mcmc import sample_mcmc, starting_points
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import ExactSettings
from swesbi.posterior.space import Space
from swesbi.recording.acquisition_settings import AcquisitionSettings
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.seeds import generator, integer_seed

LOGGER = logging.getLogger("swesbi")
STREAM: Final = "calibration"
LONG_CHAINS: Final = "mcmc"


def recordings_like_subject(
    observation: Observation,
    noise: CohortNoise,
    estimator: TrainedFlow,
    *,
    model: SpeedModelSettings,
    exact: ExactSettings,
    acquisition: AcquisitionSettings,
    recording: RecordingSettings,
    recordings: RecordingsSettings,
    seed: int,
) -> CalibrationRecordings:
    """Make recordings in the subject's context and with its phases, and infer every one.

    Half of the runs have the model's own noise and discrepancy. The others start from the same phi but are
    acquired sample by sample, with the discrepancy drawn for each phase, pass quality control and ingestion,
    get their standard errors from the cohort's variance components and their own counts, and have their own
    phases; the passive stiffness is inferred with the rest. Recordings that ingestion refuses are left out,
    and the log says how many.

    Raises:
        ValueError: Ingestion refused every recording.
    """
    subject, recorded = observation.subject, speed_model(observation, noise, model)
    own = own_recordings(recorded, recordings.model_noise, seed, STREAM)
    made = acquisition_of(observation, noise.of(subject), acquisition, recording, model.measurement)
    acquired = acquired_recordings(recorded, made, recordings.sample_by_sample, seed, STREAM)
    LOGGER.info(
        "%s: ingestion refused %d of %d recordings", subject, acquired.refused, recordings.sample_by_sample
    )
    if not len(acquired.phi):
        raise ValueError(
            f"subject {subject}: all {recordings.sample_by_sample} synthetic recordings were refused"
        )
    inferred = {}
    for kind, synthetic in ((MODEL_NOISE, own), (SAMPLE_BY_SAMPLE, acquired)):
        inferred[kind] = infer_recordings(
            recorded, synthetic, estimator, recordings, exact, seed, STREAMS[kind]
        )
        LOGGER.info("%s, %s: %s", subject, kind, _account(inferred[kind]))
    return CalibrationRecordings(**inferred)


def acquisition_of(
    observed: Observation,
    noise: NoiseComponents,
    acquisition: AcquisitionSettings,
    recording: RecordingSettings,
    measurement: MeasurementSettings,
) -> Acquisition:
    """Return how recordings like the subject's are made: with the errors of its group."""
    missing = tuple(int(index) for index in observed.phase_index[~observed.measured])
    errors = {
        "sample_sd_fraction": noise.sample_fraction,
        "repeat_sd_fraction": noise.repeat_fraction,
        "sweep_fraction": noise.sweep_fraction,
    }
    return Acquisition(acquisition.model_copy(update=errors), recording, measurement, noise, missing)


def _account(inferred: InferredRecordings) -> str:
    diagnostics = inferred.diagnostics
    return (
        f"efficiency {np.median(diagnostics.efficiency):.0%} (median), "
        f"k-hat at most {diagnostics.k_hat.max():.2f}, "
        f"MCMC took over in {int(diagnostics.by_mcmc.sum())} of {len(diagnostics.by_mcmc)}"
    )


def calibration_at_subject(
    observation: Observation,
    noise: CohortNoise,
    estimator: TrainedFlow,
    posterior: ExactPosterior,
    *,
    model: SpeedModelSettings,
    exact: ExactSettings,
    local: LocalSettings,
    with_chains: bool,
    seed: int,
) -> CalibrationLocal:
    """Rank draws of the subject's posterior given a second recording, and compare samplers pair by pair.

    Raises:
        ArtefactError: The posterior holds too few draws.
    """
    least = max(2 * local.replicates, local.two_sample_draws)
    if min(len(posterior.phi), len(posterior.proposal_phi)) < least:
        raise UnfitError(
            "posterior",
            f"holds {len(posterior.phi)} draws and {len(posterior.proposal_phi)} of the network, calibration "
            f"takes {least}; raise exact.draws, or lower calibration.local.replicates or two_sample_draws",
        )
    recorded, subject = speed_model(observation, noise, model), observation.subject
    ranked = calibrate_locally(recorded, estimator, posterior, local, exact, seed)
    network = flow_proposal(estimator, recorded.recording)
    chains = _long_chains(recorded, posterior, network, local, seed) if with_chains else None
    accuracy = _accuracies(recorded, posterior, chains, local, seed)
    for pair, value in accuracy.items():
        LOGGER.info("%s, C2ST between %s: %.3f", subject, pair, value)
    values = np.array([[*accuracy.values()]])
    draws = np.full_like(values, local.two_sample_draws)
    return CalibrationLocal(ranked, TwoSamples((subject,), tuple(accuracy), values, draws))


def _accuracies(
    model: SpeedModel, exact: ExactPosterior, chains: FloatArray | None, sizes: LocalSettings, seed: int
) -> dict[str, float]:
    """Return the accuracy of a classifier by pair of samplers, with long chains where there are any."""
    prior, count, subject = model.settings.prior, sizes.two_sample_draws, model.recording.subject
    samples = {NETWORK: exact.proposal_phi[:count], WEIGHTED: exact.phi[:count]}
    pairs = [(NETWORK, WEIGHTED)]
    if chains is not None:
        samples[LONG_CHAINS] = chains
        pairs = [(NETWORK, LONG_CHAINS), (WEIGHTED, LONG_CHAINS), *pairs]
    stream = integer_seed(seed, "calibration", "c2st", subject)
    return {
        f"{first} {second}": classifier_accuracy(samples[first], samples[second], prior, stream)
        for first, second in pairs
    }


def _long_chains(
    model: SpeedModel, exact: ExactPosterior, space: Space, sizes: LocalSettings, seed: int
) -> FloatArray:
    """Return draws (n, d) of long chains; NaN where these did not converge, which compares with nothing."""
    count, subject = sizes.two_sample_draws, model.recording.subject
    rng = generator(seed, "calibration", "mcmc", subject)
    heart = HeartModel(model)
    start = starting_points(heart, exact.weighted, sizes.mcmc.start_points, rng)
    stream = integer_seed(seed, "calibration", "mcmc", subject)
    chains = sample_mcmc(heart, start, sizes.mcmc, stream, space=space)
    LOGGER.info(
        "%s: %d steps of MCMC, R-hat at most %.4f, %.0f effective draws",
        subject, chains.steps, chains.r_hat.max(), chains.effective_draws.min(),
    )  # fmt: skip
    if chains.converged:
        return heart.evaluated(chains.thinned(count, rng)).phi
    LOGGER.warning("%s: the long chains did not converge; raise calibration.local.mcmc.max_steps", subject)
    return np.full((count, exact.phi.shape[1]), np.nan)
