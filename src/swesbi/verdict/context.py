"""Is a subject's context one that the cohort, the network or the null recordings would lead us to expect?

Standardised over the whole cohort, a value of one of n subjects never exceeds sqrt(n - 1) in size, 2.24
for six. So each subject is compared with the mean and standard deviation of the others alone.

Heart rate, end-diastolic volume and septal thickness set the simulator: with them the posterior itself
changes, so a subject is refused where they lie beyond those trained on. The other values only steer the
network, whose draws are weighted with the simulator anyway: it is shown the nearest value that it knows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from scipy.special import stdtr

from swesbi.base.arrays import FloatArray
from swesbi.context import CONTEXT_NAMES, CONTEXT_RANGES, Context
from swesbi.population.settings import PopulationSettings, in_declared_range
from swesbi.verdict.verdict import VerdictTest

CONTINUOUS: Final = tuple(name for name in CONTEXT_NAMES if name != "sex_male")
LEAST_OTHERS: Final = 3
"""Two others give a standard deviation, but a t distribution with one degree of freedom flags nothing."""
SIMULATED: Final = tuple(CONTEXT_RANGES)


def context_tests(
    context: Context, others: Sequence[Context], reached: Sequence[Context], level: float
) -> tuple[VerdictTest, ...]:
    """Return the leave-one-subject-out test, where there are enough others, and whether nulls reach a heart.

    ``level`` is of the former, all values together.
    """
    reach = _reach_test(context, reached)
    if len(others) < LEAST_OTHERS:
        return (reach,)
    return (_leave_one_out_test(context, others, level), reach)


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
    return t, np.asarray(2.0 * stdtr(n - 1, -np.abs(t)))


def _leave_one_out_test(context: Context, others: Sequence[Context], level: float) -> VerdictTest:
    columns = [CONTEXT_NAMES.index(name) for name in CONTINUOUS]
    values = np.stack([other.as_array()[columns] for other in others])
    own = context.as_array()[columns]
    t, p = leave_one_out(own, values)
    worst = int(np.argmin(p))
    # Bonferroni over the values, which all come from one subject
    joint = min(1.0, float(p[worst]) * len(CONTINUOUS))
    return VerdictTest(
        name="context_leave_one_out",
        statistic=float(np.clip(abs(t[worst]), 0.0, np.finfo(np.float64).max)),
        p_value=joint,
        threshold=level,
        flagged=joint <= level,
        detail=f"{CONTINUOUS[worst]} = {own[worst]:g} is the value that lies "
        f"farthest from the other {len(others)} subjects' (t = {t[worst]:.2f})",
    )


def _reach_test(context: Context, reached: Sequence[Context]) -> VerdictTest:
    """Tell whether null recordings have hearts like this one; only what is simulated counts."""
    beyond = outside(context, reached, margin_fraction=0.0)
    return VerdictTest(
        name="context_ranges",
        statistic=float(len(beyond)),
        p_value=None,
        threshold=0.0,
        flagged=bool(beyond),
        detail=f"no null recording has such a heart: {', '.join(beyond)}"
        if beyond
        else "null recordings have such hearts",
    )


def outside(context: Context, trained: Sequence[Context], margin_fraction: float) -> tuple[str, ...]:
    """Return a sentence for each simulated value beyond those of other contexts; none where all lie within.

    A value may lie up to ``margin_fraction`` of the smallest one below it, and of the largest one above it:
    for one subject alone that is a range too.
    """
    known = np.stack([other.as_array() for other in trained])
    low, high = known.min(axis=0), known.max(axis=0)
    value = context.as_array()
    least, most = low * (1.0 - margin_fraction), high * (1.0 + margin_fraction)
    return tuple(
        f"{name} = {value[j]:g} lies outside {least[j]:.4g} to {most[j]:.4g} "
        f"(they have {low[j]:g} to {high[j]:g})"
        for j, name in enumerate(CONTEXT_NAMES)
        if name in SIMULATED and not least[j] <= value[j] <= most[j]
    )


def refusal(context: Context, trained: Sequence[Context], margin_fraction: float) -> str:
    """Return why a network was not trained for a context, and what to do; empty where it was."""
    names = ", ".join(other.subject for other in trained)
    return _refusal(
        context,
        outside(context, trained, margin_fraction),
        f"was trained on the contexts of {names}, and cannot answer for this one",
        "put the subject into the cohort of the study and rerun it, which trains a network that knows this "
        "context",
    )


def declared_refusal(context: Context, population: PopulationSettings) -> str:
    """Return why a population's network is not declared for a context; empty where it is."""
    return _refusal(
        context,
        in_declared_range(context, population),
        "is declared for a range of hearts, and this one lies outside",
        "widen `declared_range` of the population in the configuration and rerun the study, which trains a "
        "network for it",
    )


def _refusal(context: Context, reasons: Sequence[str], why: str, remedy: str) -> str:
    if not reasons:
        return ""
    listed = "".join(f"\n  - {reason}" for reason in reasons)
    return (
        f"subject {context.subject} is refused: the network {why}:{listed}\n"
        f"If a value is wrong, correct subjects.csv. If not, {remedy}."
    )


def nearest_known(context: Context, trained: Sequence[Context]) -> Context:
    """Return the context with values that only steer the network moved into the range of those trained on.

    Heart rate, LVEDV and IVSd stay: the simulator takes them, so moving them moves the network's answer away
    from the one that the weights correct it to.
    """
    known = np.stack([other.as_array() for other in trained])
    male, *values = np.clip(context.as_array(), known.min(axis=0), known.max(axis=0)).tolist()
    nearest = Context(context.subject, "M" if male else "F", *values)
    return replace(nearest, **{name: getattr(context, name) for name in SIMULATED})
