"""Generators of the exam under the shipped configuration, and answers that are made up."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Final

import numpy as np
import speed_case

from swesbi.arrays import FloatArray
from swesbi.context import Context
from swesbi.exam.generators import all_generators
from swesbi.exam.heart import ExamHeart, Generator
from swesbi.exam.recorded import RecordedHeart, record_heart
from swesbi.exam.score import HeartAnswer
from swesbi.virtual_cohort.volunteers import TruthCurve

CONFIG = speed_case.shipped()
SEED: Final = 3
STREAM: Final = "tests"
LVESV_FRACTION: Final = CONFIG.speed_experiments[
    "calibrated"
].misspecification.rule.volumes.lvesv_tolerance_fraction
CONTEXT: Final = Context("a001", "F", 25.0, 1.7, 66.0, 90.0, 34.0, 0.8)

HEART: Final = ExamHeart(
    CONTEXT,
    TruthCurve(np.array([0.0, 0.5]), np.array([4.0, 50.0])),
    np.array([60.0, 6.0, 30.0]),
    30.0,
    40.0,
    0.4,
    118.0,
    74.0,
)


@cache
def generators() -> Mapping[str, Generator]:
    population = CONFIG.population_experiments["amortised"].population
    return all_generators(
        CONFIG.exam.made, population, CONFIG.priors["calibrated"], CONFIG.acquisition, LVESV_FRACTION
    )


@cache
def recorded(letter: str, index: int = 0, stream: str = STREAM, seed: int = SEED) -> RecordedHeart:
    grid_points = CONFIG.measurement.grid_points
    cuff = CONFIG.clinical.errors
    return record_heart(generators()[letter], index, seed, stream, CONFIG.recording, grid_points, cuff)


def answer(
    number: int = 0,
    status: str = "supported",
    truth: tuple[float, float, float, float] = (40.0, 30.0, 60.0, 6.0),
    low: float = 0.8,
    median: float = 1.0,
    high: float = 1.25,
    by_mcmc: bool = False,
    width_fixed: float = 0.25,
) -> HeartAnswer:
    """An answer whose interval's limits and median are multiples of (40, 30, 60, 6)."""
    unit: FloatArray = np.array([40.0, 30.0, 60.0, 6.0])
    return HeartAnswer(
        number, CONTEXT, 0, status, "", by_mcmc=by_mcmc, converged=True, efficiency=0.5 + 0.01 * number,
        truth=np.array(truth), low=low * unit, median=median * unit, high=high * unit,
        width_log_scale_fixed=np.full(4, width_fixed),
    )  # fmt: skip
