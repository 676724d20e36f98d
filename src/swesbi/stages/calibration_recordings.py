"""Stage: synthetic recordings of one subject with known parameters, inferred by the network and exactly."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np

from swesbi.artefacts import save
from swesbi.calibration.dataset import RECORDINGS_KIND, inferred_dataset
from swesbi.calibration.ranked import Inferred
from swesbi.calibration.recordings import infer_recordings
from swesbi.calibration.settings import RecordingsSettings
from swesbi.exact.settings import ExactSettings
from swesbi.flow.files import load_flow
from swesbi.noise.dataset import read_noise
from swesbi.recording.dataset import read_observation
from swesbi.recording.observation import Observation
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.settings import Settings
from swesbi.speed_model.model import SpeedModelSettings, speed_model
from swesbi.speed_model.recording import measured_speeds
from swesbi.speed_model.synthetic import Acquisition, acquired_recordings, own_recordings
from swesbi.stages.origin import Origin
from swesbi.virtual_cohort.settings import AcquisitionSettings

LOGGER = logging.getLogger("swesbi")
STREAM = "calibration"


class CalibrationRecordingsStageSettings(Settings):
    """What the recordings and their posteriors depend on, beside the input files."""

    model: SpeedModelSettings
    exact: ExactSettings
    acquisition: AcquisitionSettings
    recording: RecordingSettings
    recordings: RecordingsSettings


def run(
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
    phases; the passive scale is inferred with the rest. Recordings that ingestion refuses are left out, and
    the log says how many.

    Raises:
        ArtefactError: An input is no such artefact.
        ValueError: Ingestion refused every recording.
    """
    observed, components = read_observation(observation), read_noise(noise).components
    model = speed_model(measured_speeds(observed, components), settings.model)
    flow, _ = load_flow(estimator)
    sizes, subject = settings.recordings, observed.subject
    own = own_recordings(model, sizes.own, origin.seed, STREAM)
    acquisition = _acquisition(observed, components, settings)
    acquired = acquired_recordings(model, acquisition, sizes.acquired, origin.seed, STREAM)
    LOGGER.info("%s: ingestion refused %d of %d recordings", subject, acquired.refused, sizes.acquired)
    if not len(acquired.phi):
        raise ValueError(f"subject {subject}: all {sizes.acquired} synthetic recordings were refused")
    groups = {}
    for name, synthetic in (("own", own), ("acquired", acquired)):
        inferred = infer_recordings(model, synthetic, flow, sizes, settings.exact, origin.seed, name)
        LOGGER.info("%s, %s: %s", subject, name, _account(inferred))
        groups[name] = inferred_dataset(inferred)
    save(recordings, groups, origin.provenance(RECORDINGS_KIND, settings))


def _acquisition(
    observed: Observation, noise: NoiseComponents, settings: CalibrationRecordingsStageSettings
) -> Acquisition:
    missing = tuple(int(index) for index in observed.phase_index[~observed.measured])
    measurement = settings.model.measurement
    return Acquisition(settings.acquisition, settings.recording, measurement, noise, missing)


def _account(inferred: Inferred) -> str:
    found = inferred.diagnostics
    return (
        f"efficiency {np.median(found.efficiency):.0%} (median), k-hat at most {found.k_hat.max():.2f}, "
        f"MCMC took over in {int(found.by_mcmc.sum())} of {len(found.by_mcmc)}"
    )
