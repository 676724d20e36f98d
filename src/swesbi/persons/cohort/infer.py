"""The posterior of a cohort: recycled draws, its exact posterior, draws anew where too few are left."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.persons.cohort.cohort import Design, Member, design_of
from swesbi.persons.cohort.hyperprior import Hyperprior, hyperprior_of
from swesbi.persons.cohort.model import CohortModel, PriorAlone
from swesbi.persons.cohort.ratio import RatioPrior
from swesbi.persons.cohort.refresh import DrawSet, combined, shrunken_prior
from swesbi.persons.cohort.settings import HierarchySettings
from swesbi.persons.cohort.shrinkage import Shrinkage, shrink
from swesbi.posterior.adaptive import adapted
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.importance import resample
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import asking
from swesbi.posterior.space import PlacedProposal
from swesbi.prior import PriorSettings
from swesbi.seeds import generator, integer_seed

MANY: Final = 100
"""Subjects from which the way from the hyperprior is sought by a rough likelihood first, to save time."""
STREAM: Final = "cohort posterior"
PILOT_DRAWS: Final = 400
"""Draws of the population, effective ones too, by which subjects are found that lack draws."""
Redraw = Callable[[str, PriorSettings, int], FloatArray]
"""Draws theta (n, 3) anew of a subject's posterior under another prior of theta, by a seed."""


@dataclass(frozen=True)
class CohortQuestion:
    """A question about some subjects.

    Attributes:
        design: What the logarithm of a quantity depends on.
        prior: The hyperprior.
        quantity: The prior of the quantity under which the subjects' draws were made: theta, or its ratio.
    """

    design: Design
    prior: Hyperprior
    quantity: PriorSettings | RatioPrior


@dataclass(frozen=True)
class CohortResult:
    """The posterior of a cohort.

    Attributes:
        members: The d subjects.
        design: What log theta depends on.
        prior: The hyperprior.
        model: The model, with the draws that were recycled in the end.
        exact: Posterior of the population.
        eta: Draws of it that are shown; shape (m, k).
        shrinkage: What it makes of the subjects.
        refreshed: How often each subject was drawn anew; shape (d,).
        interval: Mass of the credible intervals.
    """

    members: tuple[Member, ...]
    design: Design
    prior: Hyperprior
    model: CohortModel
    exact: ExactPosterior
    eta: FloatArray
    shrinkage: Shrinkage
    refreshed: tuple[int, ...]
    interval: float


def infer_cohort(
    members: Sequence[Member],
    theta_prior: PriorSettings,
    settings: HierarchySettings,
    redraw: Redraw | None,
    seed: int,
) -> CohortResult:
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
    return infer_population(members, CohortQuestion(design, prior, theta_prior), settings, redraw, seed)


def infer_population(
    members: Sequence[Member],
    question: CohortQuestion,
    settings: HierarchySettings,
    redraw: Redraw | None,
    seed: int,
) -> CohortResult:
    """Infer the answer for some subjects, each person once; arguments as of :func:`infer_cohort`."""
    sets = [[DrawSet(member.theta, question.quantity)] for member in members]
    model = _model(members, question, sets, settings)
    first: PlacedProposal | None = None
    if len(members) >= MANY:
        rough, few = model.thinned(settings.rough_draws), asking(settings.exact, PILOT_DRAWS)
        first = adapted(rough, few, integer_seed(seed, STREAM, "rough")).proposal()
    for number in range(settings.refreshes if redraw is not None else 0):
        stream = integer_seed(seed, STREAM, "glance", number)
        pilot = adapted(model, asking(settings.exact, PILOT_DRAWS), stream, first)
        eta = resample(pilot.weighted, PILOT_DRAWS, np.random.default_rng(stream))
        lacking = _lacking(model, eta, settings, seed)
        if redraw is None or not lacking:
            break
        for subject in lacking:
            narrower, name = shrunken_prior(model, eta, subject), members[subject].subject
            anew = redraw(name, narrower, integer_seed(seed, STREAM, "anew", name, number))
            sets[subject].append(DrawSet(anew[: settings.draws], narrower))
        model, first = _model(members, question, sets, settings), pilot.proposal()
    exact, _ = exact_posterior(model, first, settings.exact, seed, STREAM)
    eta = exact.phi[: settings.shown_draws]
    return CohortResult(
        members=tuple(members),
        design=question.design,
        prior=question.prior,
        model=model,
        exact=exact,
        eta=eta,
        shrinkage=shrink(model, eta, generator(seed, STREAM, "shrinkage")),
        refreshed=tuple(len(one) - 1 for one in sets),
        interval=settings.exact.interval,
    )


def _lacking(model: CohortModel, eta: FloatArray, settings: HierarchySettings, seed: int) -> list[int]:
    """Return the subjects with too few effective draws under these of the population."""
    effective = shrink(model, eta, generator(seed, STREAM, "lacking")).effective
    return [int(d) for d in np.flatnonzero(effective < settings.least_effective)]


def _model(
    members: Sequence[Member],
    question: CohortQuestion,
    sets: Sequence[Sequence[DrawSet]],
    settings: HierarchySettings,
) -> CohortModel:
    return CohortModel(
        settings=PriorAlone(question.prior),
        recycled=tuple(combined(one) for one in sets),
        design=question.design.matrix,
        outlier=np.array([settings.outliers.of(member.status) for member in members]),
        theta_prior=question.quantity,
    )
