"""Is a subject's context one that the others, or the declared ranges, would lead us to expect?

Standardised over the whole cohort, a value of one of n subjects never exceeds sqrt(n - 1) in size, 2.24
for six. So each subject is compared with the mean and standard deviation of the others alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from swesbi.context import CONTEXT_NAMES, Context
from swesbi.inference.support import SupportTest
from swesbi.misspecification.settings import ContextCheckSettings

FloatArray = NDArray[np.float64]
CONTINUOUS: Final = tuple(name for name in CONTEXT_NAMES if name != "sex_male")
LEAST_OTHERS: Final = 3
"""Two others give a standard deviation, but a t distribution with one degree of freedom flags nothing."""


def context_tests(
    context: Context, others: Sequence[Context], settings: ContextCheckSettings
) -> tuple[SupportTest, ...]:
    """Return the leave-one-subject-out test, where there are enough others, and the declared ranges."""
    ranges = _ranges_test(context, settings)
    if len(others) < LEAST_OTHERS:
        return (ranges,)
    return (_leave_one_out_test(context, others, settings.level), ranges)


def leave_one_out(context: FloatArray, others: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return t and two-sided p of each value (d,) as one more draw of the normal behind the others (n, d).

    t = (x - mean) / (s sqrt(1 + 1/n)) with n - 1 degrees of freedom. A value in which the others do not
    differ has t = 0 if it equals theirs, else an infinite one.
    """
    n = len(others)
    spread = others.std(axis=0, ddof=1) * np.sqrt(1.0 + 1.0 / n)
    distance = context - others.mean(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(distance == 0.0, 0.0, distance / spread)
    return t, np.asarray(2.0 * student.sf(np.abs(t), n - 1))


def _leave_one_out_test(context: Context, others: Sequence[Context], level: float) -> SupportTest:
    columns = [CONTEXT_NAMES.index(name) for name in CONTINUOUS]
    values = np.stack([other.as_array()[columns] for other in others])
    t, p = leave_one_out(context.as_array()[columns], values)
    worst = int(np.argmin(p))
    # Bonferroni over the values, which all come from one subject
    joint = min(1.0, float(p[worst]) * len(CONTINUOUS))
    return SupportTest(
        name="context_leave_one_out",
        statistic=float(np.clip(abs(t[worst]), 0.0, np.finfo(np.float64).max)),
        p_value=joint,
        threshold=level,
        flagged=joint <= level,
        detail=f"{CONTINUOUS[worst]} = {_value(context, CONTINUOUS[worst]):g} is the value that lies "
        f"farthest from the other {len(others)} subjects' (t = {t[worst]:.2f})",
    )


def _ranges_test(context: Context, settings: ContextCheckSettings) -> SupportTest:
    outside = [
        f"{name} = {_value(context, name):g} outside [{low:g}, {high:g}]"
        for name, (low, high) in settings.ranges.items()
        if not low <= _value(context, name) <= high
    ]
    return SupportTest(
        name="context_ranges",
        statistic=float(len(outside)),
        p_value=None,
        threshold=0.0,
        flagged=bool(outside),
        detail=", ".join(outside) if outside else "every value lies within its declared range",
    )


def _value(context: Context, name: str) -> float:
    return float(context.as_array()[CONTEXT_NAMES.index(name)])
