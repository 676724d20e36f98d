"""Null distributions of the misspecification tests, the verdict on a subject, the rate of alarms."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from swesbi.artefacts import ArtefactError, Origin, save, write_json
from swesbi.artefacts.csv import write_csv
from swesbi.base.settings import Settings
from swesbi.context import Context
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, read_speed_model
from swesbi.measurement.settings import SummarySettings, summary_names
from swesbi.measurement.speeds import SpeedRecording, measured_speeds
from swesbi.networks.flow.conditioning import ConditioningSettings, conditioning_of, raw_features
from swesbi.networks.flow.files import load_flow
from swesbi.population.recordings import FreshSettings
from swesbi.population.settings import NullSettings
from swesbi.population.synthetic import Acquisition, acquired_recordings, own_recordings
from swesbi.posterior.result import read_exact_posterior
from swesbi.posterior.settings import ExactSettings
from swesbi.recording.acquisition_settings import AcquisitionSettings
from swesbi.recording.noise import read_noise
from swesbi.recording.observation import Observation, read_contexts, read_observation
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.verdict.pooled import KIND as NULLS
from swesbi.verdict.pooled import PopulationNull, draw_null, null_groups
from swesbi.verdict.power import COHORT, STRAINED_OR_WORSE, alarm_rows
from swesbi.verdict.pushes import draw_pushes_null
from swesbi.verdict.recordings import (
    ACQUIRED,
    NULL,
    OWN,
    VOLUNTEER,
    SubjectChecks,
    check_recordings,
    read_subject_checks,
    to_groups,
    volunteer_recordings,
)
from swesbi.verdict.recordings import KIND as CHECKS
from swesbi.verdict.settings import RuleSettings, SyntheticSettings
from swesbi.verdict.statistics import no_checks, prior_strip_mass
from swesbi.verdict.with_null import VerdictSettings, against_reference, judge
from swesbi.virtual.volunteers import VOLUNTEERS

LOGGER = logging.getLogger("swesbi")


STREAM = "misspecification"


class MisspecificationStageSettings(Settings):
    """What the synthetic recordings and their posteriors depend on."""

    model: SpeedModelSettings
    recording: RecordingSettings
    acquisition: AcquisitionSettings
    summary: SummarySettings
    synthetic: SyntheticSettings
    exact: ExactSettings

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
    model = SpeedModel(measured_speeds(observed, components), settings.model)
    flow, _ = load_flow(estimator)
    conditioning, sizes = settings.conditioning, settings.synthetic
    made = _make(model, observed, components, settings, origin.seed)
    names = summary_names(conditioning.summary)
    checks = {
        kind: check_recordings(
            model, synthetic.recordings, flow, conditioning, sizes, settings.exact, origin.seed, kind
        )
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
    if volunteer := next((one for one in VOLUNTEERS if one.context == observed.context), None):
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
    exact: ExactSettings
    rule: RuleSettings


def population_null(
    *, estimator: Path, null: Path, settings: PopulationNullStageSettings, origin: Origin
) -> None:
    """Make well-specified recordings of fresh contexts, infer each, and keep what the tests look at.

    Raises:
        ArtefactError: The network is no such artefact.
    """
    conditioning = conditioning_of(settings.summary, settings.fresh.model)
    flow, _ = load_flow(estimator)
    fresh, sizes, exact, seed = settings.fresh, settings.sizes, settings.exact, origin.seed
    contexts, pooled = draw_null(
        range(sizes.recordings), flow, fresh, conditioning, sizes, exact, settings.rule, seed
    )
    pushes = draw_pushes_null(range(sizes.free_running_recordings), flow, fresh, sizes, exact, seed)
    drawn = PopulationNull(contexts, pooled, pushes)
    save(null, null_groups(drawn), origin.provenance(NULLS, settings))


def verdict(
    *,
    posterior: Path,
    misspecification: Path,
    observation: Path,
    contexts: Path,
    noise: Path,
    verdict: Path,
    settings: VerdictSettings,
    origin: Origin,
) -> None:
    """Judge the recording of ``origin.subject`` and write one verdict with the tests behind it.

    Args:
        posterior: The exact posterior of the recording.
        misspecification: The null distributions of the subject.
        observation: The recording.
        contexts: Those of the whole cohort, with which this subject's is compared.
        noise: The cohort's noise.
        verdict: Output.

    Raises:
        ArtefactError: An input is no such artefact, or the contexts do not hold the subject's.
    """
    others = _others(contexts, origin.subject)
    model = read_speed_model(observation, noise, settings.model)
    reference = read_subject_checks(misspecification).reference(settings.rule)
    clinical, exact = read_observation(observation).clinical, read_exact_posterior(posterior)
    beats = model.simulate(exact.phi)
    found = against_reference(exact, model, beats, reference, settings, origin.seed)
    result = judge(exact, model, beats, found, others, settings, clinical)
    write_json(verdict, result.to_json())
    LOGGER.info("subject %s: %s", origin.subject, result.sentence)


def _others(path: Path, subject: str) -> list[Context]:
    """Return the contexts of the other subjects."""
    contexts = read_contexts(path)
    others = [context for context in contexts if context.subject != subject]
    if len(others) != len(contexts) - 1:
        names = ", ".join(context.subject for context in contexts)
        raise ArtefactError(f"{path}: needs the context of subject {subject}; it holds those of {names}")
    return others


class MisspecificationTableStageSettings(Settings):
    """The rule whose alarms are counted."""

    rule: RuleSettings


def misspecification_table(
    *,
    misspecifications: Sequence[Path],
    table: Path,
    settings: MisspecificationTableStageSettings,
    origin: Origin,
) -> None:
    """Count alarms on well-specified recordings and on the virtual volunteers recorded anew.

    Raises:
        ArtefactError: An input is no such artefact.
    """
    rows = alarm_rows([read_subject_checks(path) for path in misspecifications], settings.rule)
    write_csv(table, pd.DataFrame([asdict(row) for row in rows]), float_format=None)
    for row in rows:
        if row.alarm == STRAINED_OR_WORSE and (
            row.subject == COHORT or row.recordings not in (OWN, ACQUIRED)
        ):
            LOGGER.info("%s, %s: alarm on %.1f %% of %d", row.subject, row.recordings, 100 * row.rate, row.n)
