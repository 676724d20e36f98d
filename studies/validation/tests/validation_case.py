"""The configuration of the validation, and answers that are made up."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from other_hearts_case import CONTEXT

from studies.validation.score import HeartAnswer
from studies.validation.settings import configured
from swesbi.base.arrays import FloatArray
from swesbi.report.tables.validation_outcomes import QUANTITIES

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
