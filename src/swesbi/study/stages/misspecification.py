"""Null distributions of the misspecification tests, of one subject or over a population."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from swesbi.artefacts import save
from swesbi.base import Settings
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, speed_model
from swesbi.measurement.settings import SummarySettings, summary_names
from swesbi.measurement.speeds import SpeedRecording, measured_speeds
from swesbi.networks.spline.conditioning import ConditioningSettings, conditioning_of, raw_features
from swesbi.networks.spline.files import load_spline
from swesbi.population.recordings import FreshSettings
from swesbi.population.settings import NullSettings
from swesbi.population.synthetic import Acquisition, acquired_recordings, own_recordings
from swesbi.recording.noise import read_noise
from swesbi.recording.observation import Observation, read_observation
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.study.stages.origin import Origin
from swesbi.verdict.distances import prior_strip_mass
from swesbi.verdict.pooled import KIND as NULLS
from swesbi.verdict.pooled import draw_null, to_dataset
from swesbi.verdict.recordings import (
    ACQUIRED,
    NULL,
    OWN,
    VOLUNTEER,
    SubjectChecks,
    check_recordings,
    find_volunteer,
    to_groups,
    volunteer_recordings,
)
from swesbi.verdict.recordings import KIND as CHECKS
from swesbi.verdict.settings import RuleSettings, SyntheticSettings
from swesbi.verdict.statistics import no_checks
from swesbi.virtual_cohort.settings import AcquisitionSettings

LOGGER = logging.getLogger("swesbi")
STREAM = "misspecification"


class MisspecificationStageSettings(Settings):
    """What the synthetic recordings and their posteriors depend on."""

    model: SpeedModelSettings
    recording: RecordingSettings
    acquisition: AcquisitionSettings
    summary: SummarySettings
    synthetic: SyntheticSettings

    @property
    def conditioning(self) -> ConditioningSettings:
        """How measured speeds become features."""
        return conditioning_of(self.summary, self.model)


class _Made(NamedTuple):
    recordings: Sequence[SpeedRecording]
    refused: int


def misspecification(
    *,
    observation: Path,
    noise: Path,
    estimator: Path,
    misspecification: Path,
    settings: MisspecificationStageSettings,
    origin: Origin,
) -> None:
    """Make synthetic recordings of the subject, infer each, and keep what the tests look at.

    Recordings for the null and fresh ones are well-specified: phi from the prior, the recording's phases and
    standard errors, the model's own noise and discrepancy. Others start from the prior too but are acquired
    sample by sample and ingested. A virtual volunteer is also recorded anew by its own, richer physiology;
    a subject of another cohort has no such recordings.

    Raises:
        ArtefactError: An input is no such artefact.
    """
    observed, components = read_observation(observation), read_noise(noise).components
    model = speed_model(measured_speeds(observed, components), settings.model)
    flow, _ = load_spline(estimator)
    conditioning, sizes = settings.conditioning, settings.synthetic
    made = _make(model, observed, components, settings, origin.seed)
    names = summary_names(conditioning.summary)
    checks = {
        kind: check_recordings(model, synthetic.recordings, flow, conditioning, sizes, origin.seed, kind)
        if synthetic.recordings
        else no_checks(len(names))
        for kind, synthetic in made.items()
    }
    reference = own_recordings(model, sizes.reference_recordings, origin.seed, STREAM, "reference")
    speeds = np.stack([recording.speed_m_s for recording in reference.recordings])
    result = SubjectChecks(
        subject=observed.subject,
        reference_features=raw_features(speeds, model.recording.phase, conditioning),
        feature_names=names,
        prior_mass=prior_strip_mass(settings.model.prior, sizes.strip_fraction),
        recordings=checks,
        refused={kind: synthetic.refused for kind, synthetic in made.items()},
    )
    save(misspecification, to_groups(result), origin.provenance(CHECKS, settings))


def _make(
    model: SpeedModel,
    observed: Observation,
    noise: NoiseComponents,
    settings: MisspecificationStageSettings,
    seed: int,
) -> Mapping[str, _Made]:
    """Make every kind of recording."""
    sizes, measurement = settings.synthetic, settings.model.measurement
    missing = tuple(int(index) for index in observed.phase_index[~observed.measured])
    acquisition = Acquisition(settings.acquisition, settings.recording, measurement, noise, missing)
    null = own_recordings(model, sizes.null_recordings, seed, STREAM, NULL)
    own = own_recordings(model, sizes.fresh_recordings, seed, STREAM, OWN)
    acquired = acquired_recordings(model, acquisition, sizes.fresh_recordings, seed, STREAM, ACQUIRED)
    made = {
        NULL: _Made(null.recordings, 0),
        OWN: _Made(own.recordings, 0),
        ACQUIRED: _Made(acquired.recordings, acquired.refused),
        VOLUNTEER: _Made((), 0),
    }
    if volunteer := find_volunteer(observed.context):
        recordings, refused = volunteer_recordings(
            volunteer, sizes.volunteer_recordings, settings.recording, measurement.grid_points, noise, seed
        )
        made[VOLUNTEER] = _Made(recordings, refused)
    return made


class PopulationNullStageSettings(Settings):
    """What the nulls depend on."""

    fresh: FreshSettings
    summary: SummarySettings
    sizes: NullSettings
    rule: RuleSettings


def population_null(
    *, estimator: Path, null: Path, settings: PopulationNullStageSettings, origin: Origin
) -> None:
    """Make well-specified recordings of fresh contexts, infer each, and keep what the tests look at.

    Raises:
        ArtefactError: The network is no such artefact.
    """
    conditioning = conditioning_of(settings.summary, settings.fresh.model)
    flow, _ = load_spline(estimator)
    drawn = draw_null(
        range(settings.sizes.recordings), flow, settings.fresh, conditioning, settings.sizes, settings.rule,
        origin.seed,
    )  # fmt: skip
    save(null, to_dataset(drawn), origin.provenance(NULLS, settings))
