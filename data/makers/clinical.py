"""What a clinic would measure of a virtual volunteer: the true beat's pressures and ejection, with errors."""

from __future__ import annotations

from typing import Final

import numpy as np

from swesbi.heart.beats import aortic_pressure_mmhg, systolic_intervals
from swesbi.recording.cohort.clinical import ClinicalErrors, ClinicalMeasures
from swesbi.seeds import generator
from swesbi.virtual.volunteers import Truth, forward_model_of

CLINICAL_ERRORS: Final = ClinicalErrors(
    sbp_bias_mmhg=0.3, sbp_sd_mmhg=10.0, dbp_bias_mmhg=4.5, dbp_sd_mmhg=8.0, lvet_sd_ms=10.0
)
"""Errors of the shipped measures, those of ``clinical`` in config.yaml; kept here as the protocol is."""
STREAM: Final = "clinical measures"


def true_measures(truth: Truth) -> ClinicalMeasures:
    """Return systolic and diastolic pressure at the root of the aorta, and the time of ejection."""
    pressure = aortic_pressure_mmhg(truth.beats, forward_model_of(truth.volunteer))[0]
    times = systolic_intervals(truth.beats, truth.volunteer.context.period_s)
    return ClinicalMeasures(float(pressure.max()), float(pressure.min()), 1e3 * float(times.ejection_s[0]))


def with_errors(true: ClinicalMeasures, errors: ClinicalErrors, rng: np.random.Generator) -> ClinicalMeasures:
    """Return measures in the aorta as a cuff and an echocardiogram would give them, to 1 mmHg and 1 ms.

    The errors are independent; the generator gives three normal numbers.
    """
    systolic, diastolic, ejection = rng.standard_normal(3)
    return ClinicalMeasures(
        float(round(true.sbp_mmhg + errors.sbp_bias_mmhg + errors.sbp_sd_mmhg * systolic)),
        float(round(true.dbp_mmhg + errors.dbp_bias_mmhg + errors.dbp_sd_mmhg * diastolic)),
        float(round(true.lvet_ms + errors.lvet_sd_ms * ejection)),
    )


def measure(truth: Truth, seed: int) -> ClinicalMeasures:
    """Measure a volunteer; each has a stream of its own, which is none of the recording's.

    The shipped measures are those of ``ACQUISITION_SEED``.
    """
    rng = generator(seed, STREAM, truth.volunteer.context.subject)
    return with_errors(true_measures(truth), CLINICAL_ERRORS, rng)
