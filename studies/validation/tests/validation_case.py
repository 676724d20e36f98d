"""The configuration of the validation, and answers that are made up."""

from __future__ import annotations

from typing import Final

import numpy as np
from other_hearts_case import CONTEXT

from studies.validation.score import HeartAnswer
from studies.validation.settings import configured
from swesbi.base.arrays import FloatArray

VALIDATION: Final = configured()


def answer(
    number: int = 0,
    status: str = "not contradicted",
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
