"""The subjects of a reading: recordings as the study has them, or with other errors, or smoothed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from studies.acquisition_seeds.truth import truth_of
from studies.readings.settings import Treatment
from studies.readings.treatment import smooth_cycle
from swesbi.base.arrays import FloatArray
from swesbi.base.settings import Settings
from swesbi.checks.observed_curves import at_phases
from swesbi.heart.settings import ForwardModelSettings
from swesbi.measurement.likelihood import MeasuredSubject, reference_beat
from swesbi.measurement.operator import PassiveBaseline, calibrate_passive, late_diastolic
from swesbi.measurement.settings import MeasurementSettings, PassiveSettings
from swesbi.prior import PriorSettings
from swesbi.recording.acquisition_settings import ACQUISITION_SEED, AcquisitionSettings
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.recording.phases import sample_cycle
from swesbi.recording.settings import RecordingSettings
from swesbi.virtual.volunteers import record

ERRORS = ("sample_sd_fraction", "repeat_sd_fraction", "sweep_fraction", "scale_fraction")
"""Errors of the speeds; failures, outliers and the variation of RR are not among them."""


class CalibratedSubjectSettings(Settings):
    """How a recording is ingested, and the passive baseline calibrated on it."""

    recording: RecordingSettings
    measurement: MeasurementSettings
    passive: PassiveSettings
    passive_reference_prior: PriorSettings
    forward_model: ForwardModelSettings


def with_errors(acquisition: AcquisitionSettings, factor: float) -> AcquisitionSettings:
    """Return the acquisition with so many times the errors of the speeds."""
    return acquisition.model_copy(update={name: factor * getattr(acquisition, name) for name in ERRORS})


def treated_subject(
    subject: MeasuredSubject, treatment: Treatment, protocol: CalibratedSubjectSettings
) -> MeasuredSubject:
    """Return a subject with the recording that a reading asks for, its passive baseline calibrated on it.

    Raises:
        ArtefactError: The subject is no virtual volunteer and would have to be recorded anew.
        RecordingError: The new recording does not pass quality control.
        PassiveCalibrationError: Its late diastole admits no positive passive scale.
    """
    if treatment.same_recordings:
        return subject
    observed, context = subject.observation, subject.observation.context
    if treatment.noise_factor != 1.0:
        truth = truth_of(context)
        acquisition = with_errors(truth.volunteer.acquisition, treatment.noise_factor)
        changed = replace(truth, volunteer=replace(truth.volunteer, acquisition=acquisition))
        samples = record(changed, ACQUISITION_SEED)
        observed = ingest(samples, context, protocol.recording, protocol.measurement.grid_points)
    if treatment.smoothing_cycle and treatment.smoothed == "recordings":
        observed = smoothed_recording(observed, treatment.smoothing_cycle)
    reference = reference_beat(context, protocol.passive_reference_prior, protocol.forward_model)
    passive = calibrate_passive(observed, reference, protocol.passive, protocol.measurement)
    return MeasuredSubject(observed, passive, protocol.measurement)


def smoothed_recording(observation: Observation, sd_cycle: float) -> Observation:
    """Return a recording whose curve is smoothed, its stiffness at the phases read from that curve."""
    curve = smooth_cycle(observation.curve_kpa[None], sd_cycle)
    stiffness = np.where(observation.measured, at_phases(curve, observation.phase)[0], np.nan)
    return replace(observation, curve_kpa=curve[0], stiffness_kpa=stiffness)


def passive_scale_error(
    observation: Observation, passive: PassiveBaseline, settings: PassiveSettings
) -> float:
    """Return the standard error of the passive scale as a fraction of it: that of the mean it is met by."""
    window = late_diastolic(observation, settings)
    shape = sample_cycle(passive.cycle_phase, passive.stiffness_kpa[None], observation.phase)[0]
    error: FloatArray = observation.stiffness_se_kpa[window]
    return float(np.sqrt(np.sum(error**2)) / shape[window].sum())
