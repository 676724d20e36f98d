"""What has changed in groups of persons: mean and spread of the log ratio, and how groups differ in it.

A person's joint posterior of two visits gives draws of the log ratio, made under the prior that two
independent visits have. They are recycled as draws of theta are (``cohort.model``).

Peak active stiffness is left out. Its ratio is a function of all parameters of both visits, so that the
prior to divide by has no formula and differs from person to person; an estimate from simulations of the prior
is good where these lie, and the division is needed where hardly any do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from swesbi.draws import equal_weights
from swesbi.parameters import OF_THETA
from swesbi.persons.change.stored import StoredChange
from swesbi.persons.cohort.cohort import make_member
from swesbi.persons.cohort.infer import CohortResult, infer_population, of_ratios
from swesbi.persons.cohort.stored import CohortPosterior, stored_form
from swesbi.persons.settings import ChangeGroupsSettings, HierarchySettings
from swesbi.prior import PriorSettings
from swesbi.recording.observation import Observation
from swesbi.verdict.verdict import STATUSES, Status


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
