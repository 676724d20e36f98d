"""The passive baseline of a subject, calibrated along its reference beat."""

from __future__ import annotations

from swesbi.base.progress import LOGGER
from swesbi.heart.settings import ForwardModelSettings
from swesbi.measurement.likelihood import reference_beat
from swesbi.measurement.operator import PassiveBaseline, calibrate_passive
from swesbi.measurement.settings import MeasurementSettings, PassiveSettings
from swesbi.prior import PriorSettings
from swesbi.recording.observation import Observation


def calibrated_passive(
    observation: Observation,
    *,
    reference_prior: PriorSettings,
    forward_model: ForwardModelSettings,
    passive: PassiveSettings,
    measurement: MeasurementSettings,
) -> PassiveBaseline:
    """Calibrate the passive baseline along the reference beat, which runs at the prior's log-centre.

    Raises:
        PassiveCalibrationError: It cannot be calibrated.
    """
    reference = reference_beat(observation.context, reference_prior, forward_model)
    baseline = calibrate_passive(observation, reference, passive, measurement)
    LOGGER.info(
        "subject %s: passive scale %.2f kPa; late diastole %.2f kPa, %.2f of it active in the reference beat",
        observation.subject,
        baseline.scale_kpa,
        baseline.late_diastolic_observed_kpa,
        baseline.late_diastolic_active_kpa,
    )
    return baseline
