"""What has changed in groups of persons, and in words: the log ratio, and how groups differ in it.

A person's joint posterior of two visits gives draws of the log ratio, made under the prior that two
independent visits have. They are recycled as draws of theta are (``cohort.model``).

Peak active stiffness is left out. Its ratio is a function of all parameters of both visits, so that the
prior to divide by has no formula and differs from person to person; an estimate from simulations of the prior
is good where these lie, and the division is needed where hardly any do.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.draws import equal_weights, median_and_interval
from swesbi.parameters import OF_THETA, THETA
from swesbi.persons.change.stored import OF_QUANTITY, StoredChange, drawn_by
from swesbi.persons.cohort.cohort import make_member
from swesbi.persons.cohort.infer import CohortResult, infer_population, of_ratios, stored_form
from swesbi.persons.cohort.stored import NOTE_SEPARATOR, CohortPosterior
from swesbi.persons.settings import ChangeGroupsSettings, HierarchySettings
from swesbi.prior import PriorSettings
from swesbi.recording.observation import Observation
from swesbi.verdict.verdict import STATUSES, Status

SURE: Final = 0.95
"""Probability from which a sentence calls a difference one."""


def change_in_groups(
    changes: Sequence[StoredChange],
    observations: Sequence[Observation],
    *,
    prior: PriorSettings,
    change_groups: ChangeGroupsSettings,
    cohort_posterior: HierarchySettings,
    groups: dict[str, str],
    left_out: tuple[str, ...],
    seed: int,
) -> CohortPosterior:
    """Infer mean and spread of what has changed in the persons with two visits, and how their groups differ.

    ``observations`` are of the earlier visits; ``left_out`` is what is to be said of those who are left out.
    """
    members = []
    for change, observation in zip(changes, observations, strict=True):
        earlier, later = change.quantities[:, :, OF_THETA]
        members.append(
            make_member(
                replace(observation.context, subject=change.person),
                verdict_of_pair(change),
                groups.get(change.person, ""),
                (later / earlier, equal_weights(len(later))),
                (change_groups.draws, cohort_posterior.exact.interval),
                seed,
            )
        )
    quantity = of_ratios(prior, change_groups.hyperprior)
    inferred = infer_population(members, quantity, cohort_posterior, None, seed)
    return stored_form(inferred, (*left_out, *doubts(changes, inferred, change_groups.least_effective)))


def verdict_of_pair(change: StoredChange) -> Status:
    """Return the worse verdict of both visits; contradicted where the pair is of two persons, or unusable."""
    if change.one_person.flagged or not change.converged:
        return Status.CONTRADICTED
    return max(map(Status, change.verdict), key=STATUSES.index)


def doubts(changes: Sequence[StoredChange], inferred: CohortResult, least: float) -> tuple[str, ...]:
    """Say who counts as an outlier, and whose effective draws are fewer than ``least``; nothing of nobody."""
    said: Mapping[str, list[str]] = {
        "counted as outliers, since both recordings are not of one person: ": [
            change.person for change in changes if change.one_person.flagged
        ],
        "counted as outliers, since their draws have not converged: ": [
            change.person for change in changes if not change.converged
        ],
        f"rough, since fewer than {least:g} effective draws lie where the population does: ": [
            f"{member.subject} ({number:.0f})"
            for member, number in zip(inferred.members, inferred.shrinkage.effective, strict=True)
            if number < least
        ],
    }
    return tuple(f"{what}{', '.join(persons)}" for what, persons in said.items() if persons)


def group_lines(stored: CohortPosterior) -> list[str]:
    """Return what has changed in each group, how groups differ, how reliable that is, who was left out."""
    by, doubt = drawn_by(stored)
    compared = f"Groups are compared with {stored.reference_group}, the reference."
    return [
        *(line for j in range(len(THETA)) for line in _of_parameter(stored, j)),
        *([compared] if stored.groups else []),
        f"by {by}, k-hat {stored.k_hat:.2f}, {stored.efficiency:.0%} of the weighted draws effective{doubt}",
        *(f"{note[:1].upper()}{note[1:]}." for note in stored.notes.split(NOTE_SEPARATOR) if note),
    ]


def _of_parameter(stored: CohortPosterior, j: int) -> Iterator[str]:
    spread = float(np.exp(np.median(stored.population.spread[0, :, j])))
    names = stored.groups or (f"by {len(stored.member)} persons",)
    ratios = [
        f"{name} {_interval(stored.median_of(number)[:, j], stored.interval_mass)}"
        for number, name in enumerate(names)
    ]
    yield (
        f"{OF_QUANTITY[THETA[j].name]}: later over earlier, {'; '.join(ratios)}; two thirds of persons lie "
        f"within a factor of {spread:.2f} of the middle one."
    )
    for number, name in enumerate(stored.compared_group):
        draws = stored.population.group_factor[0, :, number, j]
        yield f"  {_difference(name, stored.reference_group, draws, stored.interval_mass)}"


def _difference(name: str, reference: str, draws: FloatArray, mass: float) -> str:
    above = float((draws > 1.0).mean())
    side, other, probability = ("more", "less", above) if above > 0.5 else ("less", "more", 1.0 - above)
    told = f"{name} over {reference}: {_interval(draws, mass)}"
    if probability < SURE:
        return f"{told}; that they differ is not told (higher with a probability of {above:.0%})."
    return (
        f"{told}: {name} rose {side} than {reference}, or fell {other}, with a probability of "
        f"{probability:.1%}."
    )


def _interval(draws: FloatArray, mass: float) -> str:
    low, median, high = median_and_interval(draws, mass)
    return f"{median:.2f} ({low:.2f} to {high:.2f})"
