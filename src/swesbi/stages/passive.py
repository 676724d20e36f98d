"""Stage: the passive baseline of one subject, calibrated in late diastole along a reference beat."""

from __future__ import annotations

import logging
from pathlib import Path

from swesbi.artefacts import save, to_dataset
from swesbi.forward_model.settings import ForwardModelSettings
from swesbi.forward_model.simulate import simulate
from swesbi.observation.dataset import KIND
from swesbi.observation.passive import calibrate_passive
from swesbi.observation.settings import MeasurementSettings, PassiveSettings
from swesbi.prior import PriorSettings, log_centre
from swesbi.recording.dataset import read_observation
from swesbi.settings import Settings
from swesbi.stages.origin import Origin

LOGGER = logging.getLogger("swesbi")


class PassiveStageSettings(Settings):
    """What the passive baseline depends on; the reference beat runs at the prior's log-centre."""

    forward_model: ForwardModelSettings
    prior: PriorSettings
    passive: PassiveSettings
    measurement: MeasurementSettings


def run(*, observation: Path, passive: Path, settings: PassiveStageSettings, origin: Origin) -> None:
    """Calibrate and write the passive baseline of the subject whose observed curve is given.

    Raises:
        PassiveCalibrationError: It cannot be calibrated.
    """
    observed = read_observation(observation)
    centre = log_centre(settings.prior)
    reference = simulate(centre[None, :], observed.context, settings.forward_model)
    baseline = calibrate_passive(observed, reference, settings.passive, settings.measurement)
    save(passive, to_dataset(baseline), origin.provenance(KIND, settings))
    LOGGER.info(
        "subject %s: passive scale %.2f kPa; late diastole %.2f kPa, %.2f of it active in the reference beat",
        observed.subject,
        baseline.scale_kpa,
        baseline.late_diastolic_observed_kpa,
        baseline.late_diastolic_active_kpa,
    )
