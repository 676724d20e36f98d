"""What has changed in groups of persons: mean and spread of the log ratio, and how groups differ in it.

Each person's joint posterior of two visits gives draws of delta = log theta(later) - log theta(earlier), made
under the prior pi(delta) that two independent visits have (``hierarchy.ratio``). Given eta, delta is normal
with the population's spread about the mean of the person's group, and all else of both visits is as the
prior says it is given delta. So what the recordings tell of eta is, as for theta (``hierarchy.model``)::

    p(data | eta) / p(data) = sum_n w_n p(delta_n | eta) / pi(delta_n)

Peak active stiffness is left out. Its ratio is a function of all parameters of both visits, so that the
prior to divide by has no formula and differs from person to person; an estimate from simulations of the prior
is good where these lie, and the division is needed where hardly any do.
"""

from __future__ import annotations

from collections.abc import Sequence

from swesbi.context import Context
from swesbi.draws import equal_weights
from swesbi.parameters import OF_THETA, THETA_NAMES
from swesbi.persons.change.settings import ChangeGroupsSettings, RatioHyperpriorSettings
from swesbi.persons.change.stored import StoredChange
from swesbi.persons.cohort.cohort import Design, Member, design_of, make_member
from swesbi.persons.cohort.hyperprior import FACTOR, MEDIAN, SPREAD, Hyperprior
from swesbi.persons.cohort.infer import CohortQuestion, CohortResult, infer_population
from swesbi.persons.cohort.ratio import RatioPrior
from swesbi.persons.cohort.settings import HierarchySettings
from swesbi.prior import PriorSettings
from swesbi.verdict.verdict import STATUSES, Status


def member_of_change(
    change: StoredChange,
    context: Context,
    group: str,
    settings: ChangeGroupsSettings,
    mass: float,
    seed: int,
) -> Member:
    """Return a person with the ratios that are recycled, in the place of theta.

    Args:
        change: The joint posterior of both visits.
        context: Of the person, under their name.
        group: The person's group; empty where none is given.
        settings: How many draws are recycled.
        mass: Of the credible interval.
        seed: The study's seed.
    """
    earlier, later = change.quantities[:, :, OF_THETA]
    ratio = later / earlier
    weight = equal_weights(len(ratio))
    sizes = (settings.draws, mass)
    return make_member(context, verdict_of_pair(change), group, (ratio, weight), sizes, seed)


def verdict_of_pair(change: StoredChange) -> Status:
    """Return the worse verdict of both visits; contradicted where the pair is of two persons, or unusable."""
    if change.one_person.flagged or not change.converged:
        return Status.CONTRADICTED
    return max(map(Status, change.verdict), key=STATUSES.index)


def infer_change_groups(
    members: Sequence[Member],
    theta: PriorSettings,
    settings: ChangeGroupsSettings,
    effort: HierarchySettings,
    seed: int,
) -> CohortResult:
    """Infer mean and spread of what has changed in some persons, and how groups differ in it.

    Args:
        members: The persons, each once, with ratios in the place of theta.
        theta: The prior of theta at each visit.
        settings: Hyperpriors.
        effort: Outliers and sizes.
        seed: The study's seed.

    Raises:
        ValueError: There is nobody.
    """
    if not members:
        raise ValueError("nobody has a change: groups need at least one person with two answered visits")
    design = design_of(members, covariates=())
    question = CohortQuestion(design, ratio_hyperprior(design, settings.hyperprior), RatioPrior(theta))
    return infer_population(members, question, effort, None, seed)


def ratio_hyperprior(design: Design, settings: RatioHyperpriorSettings) -> Hyperprior:
    """Return the hyperprior of what has changed, three of a row, for the groups of a design."""
    rows = [(MEDIAN, settings.median), (SPREAD, settings.spread)]
    rows += [(f"{group} {FACTOR}", settings.group_factor) for group in design.groups[1:]]
    return Hyperprior(
        rows=tuple(name for name, _ in rows),
        parameters=tuple(prior for _, prior in rows for _ in THETA_NAMES),
    )


def lacking_draws(inferred: CohortResult, least: float) -> tuple[str, ...]:
    """Return a sentence on the persons of whom too few draws lie where the population does, if any."""
    effective = inferred.shrinkage.effective
    few = [
        f"{member.subject} ({number:.0f})"
        for member, number in zip(inferred.members, effective, strict=True)
        if number < least
    ]
    if not few:
        return ()
    return (
        f"fewer than {least:g} effective draws lie where the population does of {', '.join(few)}: what they "
        "add to it is rough",
    )


def unlike_pairs(changes: Sequence[StoredChange]) -> tuple[str, ...]:
    """Return a sentence on each person whose pair counts as an outlier for another reason than a verdict."""
    flagged = [change.person for change in changes if change.one_person.flagged]
    rough = [change.person for change in changes if not change.converged]
    notes = []
    if flagged:
        notes.append(
            f"counted as outliers, since both recordings are not of one person: {', '.join(flagged)}"
        )
    if rough:
        notes.append(f"counted as outliers, since their draws have not converged: {', '.join(rough)}")
    return tuple(notes)
