"""Generators under the shipped configuration, and a heart and answers that are made up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Final

import numpy as np
import speed_case

from studies.validation.hearts.generators import Generator, all_generators
from studies.validation.hearts.heart import OtherHeart
from studies.validation.hearts.recording import RecordedHeart, record_heart
from studies.validation.score import HeartAnswer
from studies.validation.settings import configured
from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.recording.acquisition import TruthCurve
from swesbi.report.tables.validation import QUANTITIES

CONFIG = speed_case.shipped()
SEED: Final = 3
STREAM: Final = "tests"
LVESV_FRACTION: Final = speed_case.rule().volumes.lvesv_tolerance_fraction
CONTEXT: Final = Context("a001", "F", 25.0, 1.7, 66.0, 90.0, 34.0, 0.8)

PHASE: Final = np.arange(100) / 100.0
HEART: Final = OtherHeart(
    CONTEXT,
    TruthCurve(PHASE, 4.0 + 46.0 * np.exp(-0.5 * ((PHASE - 0.4) / 0.1) ** 2)),
    np.array([60.0, 6.0, 30.0]),
    30.0,
    40.0 * np.exp(-0.5 * ((PHASE - 0.4) / 0.1) ** 2),
    None,
    0.4,
)


@cache
def generators() -> Mapping[str, Generator]:
    population = CONFIG.population_experiments["amortised"].population
    return all_generators(population, CONFIG.priors["calibrated"], CONFIG.acquisition, LVESV_FRACTION)


@cache
def recorded(letter: str, index: int = 0, stream: str = STREAM, seed: int = SEED) -> RecordedHeart:
    grid_points = CONFIG.measurement.grid_points
    return record_heart(generators()[letter], index, seed, stream, CONFIG.recording, grid_points)


VALIDATION: Final = configured()
UNIT: Final = dict(zip(QUANTITIES, (40.0, 30.0, 300.0, 45.0, 20.0, 100.0, 5.0, 42.0, 60.0, 6.0), strict=True))
"""About what the intervals of answers that are made up lie."""


def truth(without: Sequence[str] = (), **changed: float) -> tuple[float, ...]:
    """Truths that lie in the intervals, but for those that are changed; NaN of what there is not."""
    values = UNIT | changed | dict.fromkeys(without, float("nan"))
    return tuple(values[name] for name in QUANTITIES)


def answer(
    number: int = 0,
    status: str = "not contradicted",
    truth: Sequence[float] = tuple(UNIT.values()),
    low: float = 0.8,
    median: float = 1.0,
    high: float = 1.25,
    by_mcmc: bool = False,
    width_fixed: float = 0.25,
) -> HeartAnswer:
    """An answer whose interval's limits and median are multiples of ``UNIT``."""
    unit: FloatArray = np.array([*UNIT.values()])
    return HeartAnswer(
        number, CONTEXT, 0, status, "", by_mcmc=by_mcmc, converged=True, efficiency=0.5 + 0.01 * number,
        truth=np.array(truth), low=low * unit, median=median * unit, high=high * unit,
        width_log_scale_fixed=np.full(len(unit), width_fixed),
    )  # fmt: skip
