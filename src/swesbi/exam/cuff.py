"""The pressures of a cuff that hearts of the exam are given: their own, with the errors that are assumed."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

from swesbi.exam.heart import ExamHeart
from swesbi.recording.clinical import ClinicalErrors, ClinicalMeasures
from swesbi.seeds import generator
from swesbi.virtual_cohort.clinical import with_errors

STREAM: Final = "cuff"
"""Behind the names of a heart's stream: nothing else of the heart is drawn from it."""


def cuff_pressures(
    heart: ExamHeart, errors: ClinicalErrors, seed: int, name: str, letter: str, index: int
) -> ClinicalMeasures:
    """Return the pressures of a cuff on the arm of a heart, to 1 mmHg; no ejection time.

    A reading whose diastolic pressure is not the lower one is none, and is taken again.

    Args:
        heart: The heart.
        errors: Of the cuff.
        seed: The study's seed.
        name: Name of the heart's stream.
        letter: Of its generator.
        index: Its number.
    """
    true = ClinicalMeasures(heart.systolic_mmhg, heart.diastolic_mmhg, 0.0)
    rng = generator(seed, name, letter, index, STREAM)
    while True:
        measured = with_errors(true, errors, rng)
        if measured.dbp_mmhg < measured.sbp_mmhg:
            return replace(measured, lvet_ms=math.nan)
