"""Does the network know hearts like this one? It learnt from few, and nothing tells it where they end.

Heart rate, end-diastolic volume and septal thickness set the simulator: with them the posterior itself
changes, so a subject is refused where they lie beyond those trained on. The other values only steer the
network, whose draws are weighted with the simulator anyway: it is shown the nearest value that it knows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from swesbi.context import CONTEXT_NAMES, CONTEXT_RANGES, Context
from swesbi.population.settings import PopulationSettings, in_declared_range

SIMULATED: Final = tuple(CONTEXT_RANGES)


class ContextRefusedError(ValueError):
    """The network cannot answer for this context; the message says for which values, and what to do."""


def outside(context: Context, trained: Sequence[Context], margin_fraction: float) -> tuple[str, ...]:
    """Return a sentence for each simulated value beyond those trained on; none if the network may answer.

    A value may lie up to ``margin_fraction`` of the smallest one below it, and of the largest one above it:
    for one subject alone that is a range too.

    Args:
        context: The new subject's.
        trained: Contexts of the n subjects that the network was trained on, at least one.
        margin_fraction: What is accepted beyond them.
    """
    known = np.stack([one.as_array() for one in trained])
    low, high = known.min(axis=0), known.max(axis=0)
    value = context.as_array()
    least, most = low * (1.0 - margin_fraction), high * (1.0 + margin_fraction)
    return tuple(
        f"{name} = {value[j]:g} lies outside {least[j]:.4g} to {most[j]:.4g} "
        f"(they have {low[j]:g} to {high[j]:g})"
        for j, name in enumerate(CONTEXT_NAMES)
        if name in SIMULATED and not least[j] <= value[j] <= most[j]
    )


def check_context(context: Context, trained: Sequence[Context], margin_fraction: float) -> None:
    """Refuse a context that the network was not trained for.

    Raises:
        ContextRefusedError: Lists every value that lies outside.
    """
    reasons = outside(context, trained, margin_fraction)
    if not reasons:
        return
    names = ", ".join(one.subject for one in trained)
    listed = "".join(f"\n  - {reason}" for reason in reasons)
    raise ContextRefusedError(
        f"subject {context.subject} is refused: the network was trained on the contexts of {names}, and "
        f"cannot answer for this one:{listed}\nIf a value is wrong, correct subjects.csv. If not, put the "
        "subject into the cohort of the study and rerun it, which trains a network that knows this context."
    )


def check_declared(context: Context, population: PopulationSettings) -> None:
    """Refuse a context outside the range for which a population's network is declared.

    Raises:
        ContextRefusedError: Lists every value that lies outside.
    """
    if reasons := in_declared_range(context, population):
        listed = "".join(f"\n  - {reason}" for reason in reasons)
        raise ContextRefusedError(
            f"subject {context.subject} is refused: the network is declared for a range of hearts, and this "
            f"one lies outside:{listed}\nIf a value is wrong, correct subjects.csv. If not, widen "
            "`declared_range` of the population in the configuration and rerun the study, which trains a "
            "network for it."
        )


def nearest_known(context: Context, trained: Sequence[Context]) -> Context:
    """Return the context with values that only steer the network moved into the range of those trained on.

    Heart rate, LVEDV and IVSd stay: the simulator takes them, so moving them moves the network's answer away
    from the one that the weights correct it to.
    """
    known = np.stack([one.as_array() for one in trained])
    male, *values = np.clip(context.as_array(), known.min(axis=0), known.max(axis=0)).tolist()
    nearest = Context(context.subject, "M" if male else "F", *values)
    return replace(nearest, **{name: getattr(context, name) for name in SIMULATED})
