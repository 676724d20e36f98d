"""What the posterior's beats do beside measured volumes and ejection times, which nobody fitted.

How far the two may lie apart the prior does not say, so they have no null distribution: their distance is
counted in standard deviations of the posterior, of the measurement, and of the model. Of a heart that the
model describes, that distance is normal.

The model lets one septal thickness stand for the whole sphere: how far it may be wrong in a volume is how far
a wall of another thickness moves it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.heart.beats import systolic_intervals
from swesbi.heart.periodic import Status
from swesbi.heart.simulate import Beats
from swesbi.measurement.likelihood import SpeedModel
from swesbi.recording.cohort.clinical import ClinicalMeasures
from swesbi.verdict.settings import EjectionTimeSettings, VolumeSettings
from swesbi.verdict.verdict import VerdictTest

VOLUMES: Final = (("end_diastolic_volume", "LVEDV"), ("end_systolic_volume", "LVESV"))
"""Names of their tests, and what echocardiography calls them."""
WALL_DRAWS: Final = 200
"""Of the posterior, simulated with another wall: its median moves by less than a tenth of its distance."""
THICK_CM: Final = 1.0
"""Thicker walls are tried thinner, others thicker: neither leaves what the forward model is declared for."""


@dataclass(frozen=True)
class BeatQuantity:
    """One quantity of the beat, all in its own unit or in its logarithm: draws (n,), and the measurement.

    ``model_sd`` is how far the model may be wrong in it.
    """

    values: FloatArray
    model_sd: float
    measured: float
    measurement_sd: float

    @property
    def sd(self) -> float:
        """Standard deviation of posterior, model and measurement together."""
        return float(np.sqrt(self.values.var() + self.model_sd**2 + self.measurement_sd**2))

    @property
    def z(self) -> float:
        """Median of the prediction less what was measured, over their standard deviation."""
        return float((np.median(self.values) - self.measured) / self.sd)

    def test(self, name: str, limit: float, detail: str) -> VerdictTest:
        """Return the test that is flagged where the two lie more than ``limit`` standard deviations apart."""
        return VerdictTest(
            name=name,
            statistic=self.z,
            p_value=None,
            threshold=limit,
            flagged=abs(self.z) > limit,
            detail=f"{detail} (z = {self.z:.2f})",
        )


def in_words(short: str, values: FloatArray, measured: float, unit: str) -> str:
    """Return median and 90 % interval of predicted values (n,), and what was measured."""
    low, middle, high = np.quantile(values, (0.05, 0.5, 0.95))
    return f"{short} {middle:.0f} {unit} predicted [{low:.0f}, {high:.0f}], {measured:.0f} {unit} measured"


def ejection_tests(
    beats: Beats,
    period_s: float,
    clinical: ClinicalMeasures,
    lvet_sd_ms: float,
    settings: EjectionTimeSettings,
) -> tuple[VerdictTest, ...]:
    """Compare the ejection time of the posterior's beats with the measured one; no test where there is none.

    A beat in which a valve never opens ejects for no time.
    """
    if not clinical.has_ejection_time:
        return ()
    works = beats.status == Status.PERIODIC
    lvet_ms = np.nan_to_num(1e3 * systolic_intervals(beats, period_s).ejection_s[works])
    predicted = BeatQuantity(lvet_ms, settings.model_sd_ms, clinical.lvet_ms, lvet_sd_ms)
    limit = settings.doubtful_abs_z
    said = in_words("LVET", lvet_ms, clinical.lvet_ms, "ms")
    return (predicted.test("ejection_time", limit, f"{said}, {limit * predicted.sd:.0f} ms tolerated"),)


def volume_tests(
    model: SpeedModel, phi: FloatArray, beats: Beats, settings: VolumeSettings
) -> tuple[VerdictTest, ...]:
    """Compare the end-diastolic and end-systolic volumes that the posterior predicts with LVEDV and LVESV.

    Their errors are shares of a volume, so their distance is that of the logarithms. Raises ValueError where
    no beat becomes periodic with a wall of another thickness.
    """
    context, works = model.recording.context, beats.status == Status.PERIODIC
    moved = _moved_by_wall(model, phi, beats, settings.wall_fraction)
    volumes_ml = beats.end_diastolic_volume_ml[works], beats.end_systolic_volume_ml[works]
    measured_ml = context.lvedv_ml, context.lvesv_ml
    fractions = settings.lvedv_tolerance_fraction, settings.lvesv_tolerance_fraction
    asked = zip(VOLUMES, volumes_ml, measured_ml, fractions, moved, strict=True)
    tests = []
    for (name, short), volume_ml, listed_ml, fraction, of_wall in asked:
        predicted = BeatQuantity(np.log(volume_ml), of_wall, float(np.log(listed_ml)), fraction)
        said = in_words(short, volume_ml, listed_ml, "mL")
        factor = np.exp(settings.doubtful_abs_z * predicted.sd)
        detail = f"{said}, a factor of {factor:.2f} tolerated"
        tests.append(predicted.test(name, settings.doubtful_abs_z, detail))
    return tuple(tests)


def _moved_by_wall(model: SpeedModel, phi: FloatArray, beats: Beats, fraction: float) -> tuple[float, float]:
    """Return how far a wall thicker or thinner by this fraction moves both logs, in the median."""
    rows = np.unique(np.linspace(0, len(phi) - 1, WALL_DRAWS).astype(int))
    recording = replace(model.recording, context=_with_other_wall(model.recording.context, fraction))
    other = replace(model, recording=recording).simulate(phi[rows])
    both = (beats.status[rows] == Status.PERIODIC) & (other.status == Status.PERIODIC)
    if not both.any():
        raise ValueError(
            f"subject {recording.context.subject}: no beat becomes periodic with ivsd_cm = "
            f"{recording.context.ivsd_cm:g}; check the context"
        )
    diastolic = np.log(other.end_diastolic_volume_ml / beats.end_diastolic_volume_ml[rows])
    systolic = np.log(other.end_systolic_volume_ml / beats.end_systolic_volume_ml[rows])
    return float(np.median(np.abs(diastolic[both]))), float(np.median(np.abs(systolic[both])))


def _with_other_wall(context: Context, fraction: float) -> Context:
    sign = -1.0 if context.ivsd_cm > THICK_CM else 1.0
    return replace(context, ivsd_cm=context.ivsd_cm * (1.0 + sign * fraction))
