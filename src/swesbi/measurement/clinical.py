"""One recording with the pressures of a cuff, and the likelihood of both.

Pressures inform the circulation: resistance and compliance of the arteries, and the stressed volume. Where a
prior fixes the volume, its part of the pressures is read as resistance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.heart.beats import aortic_pressure_mmhg
from swesbi.heart.simulate import Beats
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings
from swesbi.measurement.speeds import WallPhases
from swesbi.recording.cohort.clinical import ClinicalErrors, ClinicalMeasures

LOG_ROOT_TWO_PI: Final = 0.5 * np.log(2.0 * np.pi)


@dataclass(frozen=True)
class ClinicalModel:
    """The model of a recording with both pressures of a cuff; errors count from the root of the aorta."""

    speeds: SpeedModel
    clinical: ClinicalMeasures
    errors: ClinicalErrors

    @property
    def settings(self) -> SpeedModelSettings:
        """The settings of the model, its prior among them."""
        return self.speeds.settings

    def simulate(self, phi: FloatArray) -> Beats:
        """Simulate phi of shape (n, d) in the subject's context; failed rows hold NaN."""
        return self.speeds.simulate(phi)

    def wall_and_density(self, phi: FloatArray) -> tuple[WallPhases, FloatArray]:
        """Simulate phi (n, d): the wall at the measured phases, and log p(pressures | phi) of shape (n,).

        NaN and -inf where the simulation failed. Speeds and pressures have independent errors.
        """
        beats = self.simulate(phi)
        aortic = aortic_pressure_mmhg(beats, self.settings.forward_model)
        density = log_pressure_density(aortic, self.clinical, self.errors)
        return self.speeds.wall_at_phases(beats), density


def log_pressure_density(
    aortic_mmhg: FloatArray, clinical: ClinicalMeasures, errors: ClinicalErrors
) -> FloatArray:
    """Return log p(systolic, diastolic | beat) of the two pressures of a cuff; shape (n,).

    Each is normal about the largest and the smallest pressure at the root of the aorta, plus its bias.
    The errors are independent. A failed beat has NaN in its pressure (n, M), which gives -inf.
    """
    systolic = clinical.sbp_mmhg - aortic_mmhg.max(axis=1) - errors.sbp_bias_mmhg
    diastolic = clinical.dbp_mmhg - aortic_mmhg.min(axis=1) - errors.dbp_bias_mmhg
    total = _log_normal(systolic, errors.sbp_sd_mmhg) + _log_normal(diastolic, errors.dbp_sd_mmhg)
    return np.where(np.isnan(total), -np.inf, total)


def _log_normal(error: FloatArray, sd: float) -> FloatArray:
    return np.asarray(-0.5 * (error / sd) ** 2 - np.log(sd) - LOG_ROOT_TWO_PI)


def with_pressures(model: SpeedModel, clinical: ClinicalMeasures, errors: ClinicalErrors) -> ClinicalModel:
    """Return the model of a recording with its pressures, given that of its speeds.

    ValueError: a pressure was not measured, or the circulation is open and has no volume of its own.
    """
    subject = model.recording.subject
    if not clinical.has_pressures:
        raise ValueError(
            f"subject {subject}: no pressures were measured; enter sbp_mmhg and dbp_mmhg in subjects.csv"
        )
    if model.settings.forward_model.circulation != "closed":
        raise ValueError(
            f"subject {subject}: pressures need forward_model.circulation: closed, which keeps a volume"
        )
    return ClinicalModel(model, clinical, errors)
