"""What has changed in groups, in sentences that a clinician can read."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.draws import median_and_interval
from swesbi.parameters import THETA
from swesbi.persons.change.stored_groups import NOTE_SEPARATOR, ChangeGroups

SURE: Final = 0.95
"""Probability from which a sentence calls a difference one."""


def group_lines(stored: ChangeGroups) -> list[str]:
    """Return what has changed in each group, how groups differ, how reliable that is, who was left out."""
    doubt = "" if stored.converged else "; NOT CONVERGED, do not use"
    by = "MCMC" if stored.sampler == "mcmc" else "importance weights"
    notes = [note for note in stored.notes.split(NOTE_SEPARATOR) if note]
    return [
        *(line for j in range(len(THETA)) for line in _of_parameter(stored, j)),
        f"by {by}, k-hat {stored.k_hat:.2f}, {stored.efficiency:.0%} of the weighted draws effective{doubt}",
        *(f"{note[:1].upper()}{note[1:]}." for note in notes),
    ]


def _of_parameter(stored: ChangeGroups, j: int) -> Iterator[str]:
    what = f"{THETA[j].meaning} {THETA[j].text}"
    spread = float(np.exp(np.median(stored.population.spread[0, :, j])))
    each = f"two thirds of persons lie within a factor of {spread:.2f} of the middle one"
    if not stored.groups:
        ratio = _interval(stored.ratio_of(0)[:, j], stored.interval_mass)
        yield f"{what}: later over earlier {ratio} by {len(stored.person)} persons; {each}."
    else:
        ratios = (
            f"{name} {_interval(stored.ratio_of(number)[:, j], stored.interval_mass)}"
            for number, name in enumerate(stored.groups)
        )
        yield f"{what}: later over earlier, {'; '.join(ratios)}; {each}."
    for number, name in enumerate(stored.compared_group):
        draws = stored.population.group_factor[0, :, number, j]
        yield f"  {_difference(name, stored.first_group, draws, stored.interval_mass)}"


def _difference(name: str, first: str, draws: FloatArray, mass: float) -> str:
    above = float((draws > 1.0).mean())
    side, probability = ("more", above) if above > 0.5 else ("less", 1.0 - above)
    told = f"{name} over {first}: {_interval(draws, mass)}"
    if probability < SURE:
        return f"{told}; that they differ is not told (higher with a probability of {above:.0%})."
    other = "less" if side == "more" else "more"
    return (
        f"{told}: {name} rose {side} than {first}, or fell {other}, with a probability of {probability:.1%}."
    )


def _interval(draws: FloatArray, mass: float) -> str:
    low, median, high = median_and_interval(draws, mass)
    return f"{median:.2f} ({low:.2f} to {high:.2f})"
