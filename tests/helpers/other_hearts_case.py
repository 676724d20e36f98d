"""Generators of other hearts under the shipped configuration, and a heart that is made up."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Final

import numpy as np
import speed_case

from swesbi.context import Context
from swesbi.recording.acquisition import TruthCurve
from swesbi.virtual.hearts.generators import all_generators
from swesbi.virtual.hearts.heart import Generator, OtherHeart
from swesbi.virtual.hearts.recording import RecordedHeart, record_heart

CONFIG = speed_case.shipped()
SEED: Final = 3
STREAM: Final = "tests"
LVESV_FRACTION: Final = CONFIG.speed_experiments[
    "calibrated"
].misspecification.rule.volumes.lvesv_tolerance_fraction
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
