"""The posterior of a cohort: recycled draws, its exact posterior, draws anew where too few are left."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.parameters import THETA
from swesbi.persons.cohort.cohort import COVARIATES, Design, Member, design_of
from swesbi.persons.cohort.hyperprior import Hyperprior, hyperprior_of
from swesbi.persons.cohort.model import CohortModel, PriorAlone
from swesbi.persons.cohort.ratio import RatioPrior
from swesbi.persons.cohort.refresh import DrawSet, combined, shrunken_prior
from swesbi.persons.cohort.settings import HierarchySettings, HyperpriorSettings, RatioHyperpriorSettings
from swesbi.persons.cohort.shrinkage import Shrinkage, shrink
from swesbi.posterior.adaptive import adapted
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.importance import resample
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import asking
from swesbi.posterior.space import PlacedProposal
from swesbi.prior import ParameterPrior, PriorSettings
from swesbi.seeds import generator, integer_seed

MANY: Final = 100
"""Subjects from which the way from the hyperprior is sought by a rough likelihood first, to save time."""
STREAM: Final = "cohort posterior"
PILOT_DRAWS: Final = 400
"""Draws of the population, effective ones too, by which subjects are found that lack draws."""
Redraw = Callable[[str, PriorSettings, int], FloatArray]
"""Draws theta (n, 3) anew of a subject's posterior under another prior of theta, by a seed."""


@dataclass(frozen=True)
class Quantity:
    """What a population is of.

    Attributes:
        prior: The prior under which the draws of its members were made.
        median: Prior of the median of each parameter.
        hyperprior: Priors of its spread and of its factors.
        covariates: On which slopes are asked for, of ``cohort.COVARIATES``.
        units: Of each parameter.
    """

    prior: PriorSettings | RatioPrior
    median: tuple[ParameterPrior, ...]
    hyperprior: HyperpriorSettings | RatioHyperpriorSettings
    covariates: tuple[str, ...]
    units: tuple[str, ...]


def of_theta(
    prior: PriorSettings, hyperprior: HyperpriorSettings, covariates: tuple[str, ...] = COVARIATES
) -> Quantity:
    """Return theta as what a population is of.

    Its prior says where one heart may lie before it is measured; where the middle of all lies is not known
    better beforehand, so the medians have that prior.
    """
    units = tuple(parameter.cf_unit for parameter in THETA)
    return Quantity(prior, prior.parameters, hyperprior, covariates, units)


def of_ratios(theta: PriorSettings, hyperprior: RatioHyperpriorSettings) -> Quantity:
    """Return the ratios of theta at two visits as what a population is of, by theta's prior at each visit."""
    alike = len(THETA)
    return Quantity(RatioPrior(theta), (hyperprior.median,) * alike, hyperprior, (), ("1",) * alike)


@dataclass(frozen=True)
class CohortResult:
    """The posterior of a population.

    Attributes:
        members: The d members.
        quantity: What it is of.
        design: What the logarithm of the quantity depends on.
        prior: The hyperprior.
        model: The model, with the draws that were recycled in the end.
        exact: Posterior of the population.
        eta: Draws of it that are shown; shape (m, k).
        shrinkage: What it makes of the members.
        refreshed: How often each member was drawn anew; shape (d,).
        interval: Mass of the credible intervals.
    """

    members: tuple[Member, ...]
    quantity: Quantity
    design: Design
    prior: Hyperprior
    model: CohortModel
    exact: ExactPosterior
    eta: FloatArray
    shrinkage: Shrinkage
    refreshed: tuple[int, ...]
    interval: float


def infer_population(
    members: Sequence[Member],
    quantity: Quantity,
    settings: HierarchySettings,
    redraw: Redraw | None,
    seed: int,
) -> CohortResult:
    """Infer what the population of some members is like, and each of them within it.

    Args:
        members: Each person once; at least one.
        quantity: What was drawn of them.
        settings: Sizes, outliers, the group that others are compared with.
        redraw: Draws a member anew; None: nobody is.
        seed: Seed of everything.

    Raises:
        ValueError: There is nobody, or no group of that name.
    """
    if not members:
        raise ValueError("a population needs at least one person who was answered; there is none")
    design = design_of(members, quantity.covariates, settings.reference_group)
    prior = hyperprior_of(design, quantity.median, quantity.hyperprior)

    def model_of(sets: Sequence[Sequence[DrawSet]]) -> CohortModel:
        return CohortModel(
            settings=PriorAlone(prior),
            recycled=tuple(combined(one) for one in sets),
            design=design.matrix,
            outlier=np.array([settings.outliers.of(member.status) for member in members]),
            theta_prior=quantity.prior,
        )

    sets = [[DrawSet(member.theta, quantity.prior)] for member in members]
    model = model_of(sets)
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
        model, first = model_of(sets), pilot.proposal()
    exact, _ = exact_posterior(model, first, settings.exact, seed, STREAM)
    eta = exact.phi[: settings.shown_draws]
    return CohortResult(
        members=tuple(members),
        quantity=quantity,
        design=design,
        prior=prior,
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
