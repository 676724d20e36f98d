"""The posterior of a cohort: recycled draws, its exact posterior, draws anew where too few are left."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.arrays import FloatArray
from swesbi.hierarchy.cohort import Design, Member, design_of
from swesbi.hierarchy.hyperprior import Hyperprior, first_proposal, hyperprior_of
from swesbi.hierarchy.model import CohortModel, PopulationSettings, RecycledDraws
from swesbi.hierarchy.refresh import DrawSet, combined, shrunken_prior
from swesbi.hierarchy.settings import HierarchySettings
from swesbi.hierarchy.shrinkage import Shrunken, shrink
from swesbi.posterior.exact import ExactPosterior
from swesbi.posterior.importance import Proposal
from swesbi.posterior.refine import LogitSpace, fit_in_nearest, refine, refined_posterior
from swesbi.prior import PriorSettings
from swesbi.seeds import generator, integer_seed

MANY: Final = 100
"""Subjects from which the way from the hyperprior is sought by a rough likelihood first, to save time."""
Redraw = Callable[[str, PriorSettings, int], FloatArray]
"""Draws theta (n, 3) anew of a subject's posterior under another prior of theta, by a seed."""


@dataclass(frozen=True)
class Inferred:
    """The posterior of a cohort.

    Attributes:
        members: The d subjects.
        design: What log theta depends on.
        prior: The hyperprior.
        model: The model, with the draws that were recycled in the end.
        exact: Posterior of the population.
        eta: Draws of it that are shown; shape (m, k).
        shrunken: What it makes of the subjects.
        refreshed: How often each subject was drawn anew; shape (d,).
        interval: Mass of the credible intervals.
    """

    members: tuple[Member, ...]
    design: Design
    prior: Hyperprior
    model: CohortModel
    exact: ExactPosterior
    eta: FloatArray
    shrunken: Shrunken
    refreshed: tuple[int, ...]
    interval: float


def infer_cohort(
    members: Sequence[Member],
    theta_prior: PriorSettings,
    settings: HierarchySettings,
    redraw: Redraw | None,
    seed: int,
) -> Inferred:
    """Infer what the population of some subjects is like, and each subject within it.

    Args:
        members: The subjects, each person once; at least one.
        theta_prior: The prior under which their posteriors were drawn.
        settings: Sizes, hyperpriors, outliers.
        redraw: Draws a subject anew; None: nobody is.
        seed: Seed of everything.

    Raises:
        ValueError: There is no subject.
    """
    if not members:
        raise ValueError("no subject has a posterior: a cohort needs at least one")
    design = design_of(members)
    prior = hyperprior_of(design, theta_prior, settings.hyperprior)
    sets = [[DrawSet(member.theta, theta_prior)] for member in members]
    proposal = first_proposal(prior)
    for number in range(settings.refreshes + 1):
        model = _model(members, prior, design, [combined(one) for one in sets], theta_prior, settings)
        if number == 0 and len(members) >= MANY:
            rough = model.thinned(settings.rough_draws)
            stream = integer_seed(seed, "cohort posterior", "rough")
            proposal = refine(rough, proposal, settings.exact.refinement, stream).proposal
        exact, _ = refined_posterior(model, proposal, settings.exact, seed, "cohort posterior", number)
        eta = exact.phi[: settings.shown_draws]
        shrunken = shrink(model, eta, generator(seed, "cohort posterior", "shrinkage", number))
        lacking = [int(d) for d in np.flatnonzero(shrunken.effective < settings.least_effective)]
        if redraw is None or number == settings.refreshes or not lacking:
            break
        for subject in lacking:
            narrower = shrunken_prior(model, eta, subject)
            name = members[subject].subject
            stream = integer_seed(seed, "cohort posterior", "anew", name, number)
            anew = redraw(name, narrower, stream)[: settings.draws]
            sets[subject].append(DrawSet(anew, narrower))
        proposal = fitted_to(prior, exact.phi, integer_seed(seed, "cohort posterior", "proposal", number))
    return Inferred(
        members=tuple(members),
        design=design,
        prior=prior,
        model=model,
        exact=exact,
        eta=eta,
        shrunken=shrunken,
        refreshed=tuple(len(one) - 1 for one in sets),
        interval=settings.exact.interval,
    )


def fitted_to(prior: Hyperprior, eta: FloatArray, seed: int) -> Proposal:
    """Return a proposal fitted to equally weighted draws eta (m, k)."""
    return fit_in_nearest([LogitSpace(prior)], eta, np.full(len(eta), -np.log(len(eta))), seed)


def _model(
    members: Sequence[Member],
    prior: Hyperprior,
    design: Design,
    recycled: Sequence[RecycledDraws],
    theta_prior: PriorSettings,
    settings: HierarchySettings,
) -> CohortModel:
    return CohortModel(
        settings=PopulationSettings(prior),
        recycled=tuple(recycled),
        design=design.matrix,
        outlier=np.array([settings.outliers.of(member.status) for member in members]),
        theta_prior=theta_prior,
    )
