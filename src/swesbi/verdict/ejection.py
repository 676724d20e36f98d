"""The ejection time that the posterior's beats have beside the measured one, which nobody fitted."""

from __future__ import annotations

import numpy as np

from swesbi.heart.intervals import systolic_intervals
from swesbi.heart.periodic import Status
from swesbi.heart.simulate import Beats
from swesbi.recording.clinical import ClinicalMeasures
from swesbi.verdict.beat import Predicted
from swesbi.verdict.settings import EjectionTimeSettings
from swesbi.verdict.verdict import VerdictTest


def ejection_tests(
    beats: Beats,
    period_s: float,
    clinical: ClinicalMeasures,
    lvet_sd_ms: float,
    settings: EjectionTimeSettings,
) -> tuple[VerdictTest, ...]:
    """Compare the ejection time of the posterior's beats with the measured one; no test where there is none.

    A beat in which a valve never opens ejects for no time.

    Args:
        beats: Of equally weighted posterior draws; some are periodic.
        period_s: Their period.
        clinical: What was measured of the subject.
        lvet_sd_ms: Standard deviation of that measurement.
        settings: The model's tolerance, and the limit.
    """
    if not clinical.has_ejection_time:
        return ()
    works = beats.status == Status.PERIODIC
    lvet_ms = np.nan_to_num(1e3 * systolic_intervals(beats, period_s).ejection_s[works])
    predicted = Predicted(lvet_ms, settings.model_sd_ms, clinical.lvet_ms, lvet_sd_ms)
    return (predicted.test("ejection_time", "LVET", "ms", settings.strained_abs_z),)
