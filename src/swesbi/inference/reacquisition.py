"""A simulated subject measured anew: acquisition noise, quality control, passive calibration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.forward_model.beats import Beats
from swesbi.inference.subjects import MeasuredSubject
from swesbi.observation.interpolation import sample_cycle, to_grid
from swesbi.observation.operator import total_cycle
from swesbi.observation.passive import PassiveBaseline, calibrate_passive
from swesbi.observation.settings import MeasurementSettings, PassiveSettings, SummarySettings
from swesbi.observation.summary import summarise
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.recording.settings import RecordingSettings
from swesbi.virtual_cohort.acquisition import acquire
from swesbi.virtual_cohort.settings import AcquisitionSettings
from swesbi.virtual_cohort.truth import TruthCurve

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Reacquisition:
    """What one subject's recordings are made and read with.

    Attributes:
        subject: Gives context, measured phases and the true passive baseline.
        reference: One beat in the subject's context, on which the passive baseline is calibrated.
        acquisition: Protocol and noise.
        recording: Quality control.
        passive: Passive calibration.
        measurement: Measurement operator.
        summary: Summary operator S(.).
    """

    subject: MeasuredSubject
    reference: Beats
    acquisition: AcquisitionSettings
    recording: RecordingSettings
    passive: PassiveSettings
    measurement: MeasurementSettings
    summary: SummarySettings

    def features(
        self, cycle_phase: FloatArray, active_stiffness_kpa: FloatArray, rng: np.random.Generator
    ) -> FloatArray:
        """Record the curve of one active stiffness (M,) and return its features, shape (F,).

        The recording takes its passive baseline from itself, as every recording of the study does; the
        estimator knows the subject's first baseline, so the recording is moved to it.

        Raises:
            RecordingError: Too few samples or phases passed quality control.
            PassiveCalibrationError: The recording's late diastole admits no positive passive scale.
        """
        true_passive, observed_at = self.subject.passive, self.subject.observation
        truth = total_cycle((cycle_phase, active_stiffness_kpa[None]), true_passive, self.measurement)[0]
        missing = tuple(int(index) for index in observed_at.phase_index[~observed_at.measured])
        protocol = self.acquisition.model_copy(update={"missing_phases": missing})
        samples = acquire(TruthCurve(cycle_phase, truth), observed_at.context, protocol, rng)
        recorded = ingest(samples, observed_at.context, self.recording, self.measurement.grid_points)
        calibrated = calibrate_passive(recorded, self.reference, self.passive, self.measurement)
        return features_under(true_passive, recorded, calibrated, self.measurement, self.summary)


def features_under(
    trained: PassiveBaseline,
    recorded: Observation,
    calibrated: PassiveBaseline,
    measurement: MeasurementSettings,
    summary: SummarySettings,
) -> FloatArray:
    """Return the features (F,) of a recording, moved from its own passive baseline to that of the training.

    An estimator knows each subject under one passive baseline. A recording with another is moved by the
    difference of the two at its phases, which is what training under the new one would amount to:
    E_obs - E_pass is compared with E_act in both.

    Args:
        trained: The baseline under which the subject's training features were simulated.
        recorded: The recording.
        calibrated: The baseline calibrated on the recording.
        measurement: The measurement operator.
        summary: The summary operator S(.).
    """
    phase = recorded.measured_phase
    move = trained.stiffness_kpa - calibrated.stiffness_kpa
    at_phases = sample_cycle(trained.cycle_phase, move[None], phase)[0]
    moved = recorded.stiffness_kpa[recorded.measured] + at_phases
    features: FloatArray = summarise(to_grid(phase, moved[None], measurement.grid_points), summary)[0]
    return features
