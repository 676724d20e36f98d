"""The posterior of a cohort: recycled draws, its exact posterior, draws anew where too few are left.

A subject's posterior is drawn anew under a narrower prior of theta, near what the population says of it.
Old and new draws together are then weighted to the posterior under the first prior: each counts as if it came
from the mixture of all sets (balance heuristic, Veach and Guibas 1995). The sets differ in their priors
alone, so all that is unknown of the mixture is the evidence under each, which the draws themselves give
(Geyer's reverse logistic regression; Shirts and Chodera 2008, J Chem Phys 129:124105, Eq. 11).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.special import logsumexp

from swesbi.base.arrays import FloatArray
from swesbi.measurement.likelihood import SpeedModel
from swesbi.parameters import OF_THETA, THETA, THETA_NAMES
from swesbi.persons.cohort.cohort import (
    COVARIATES,
    Design,
    Hyperprior,
    Member,
    design_of,
    hyperprior_of,
    in_rows,
)
from swesbi.persons.cohort.model import (
    CohortModel,
    PriorAlone,
    RatioPrior,
    RecycledDraws,
    Shrinkage,
    log_density,
    population_law,
    shrink,
)
from swesbi.persons.settings import HierarchySettings, HyperpriorSettings, RatioHyperpriorSettings
from swesbi.posterior.adaptive import adapted
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.fitted import fit_in_nearest, placed_in
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.importance import resample
from swesbi.posterior.result import MCMC, ExactPosterior
from swesbi.posterior.settings import ExactSettings, asking
from swesbi.posterior.space import LogitSpace, PlacedProposal
from swesbi.prior import ParameterPrior, PriorSettings, bounds
from swesbi.seeds import generator, integer_seed

MANY: Final = 100
"""Subjects from which the way from the hyperprior is sought by a rough likelihood first, to save time."""
STREAM: Final = "cohort posterior"
PILOT_DRAWS: Final = 400
"""Draws of the population, effective ones too, by which subjects are found that lack draws."""
Redraw = Callable[[str, PriorSettings, int], FloatArray]
"""Draws theta (n, 3) anew of a subject's posterior under another prior of theta, by a seed."""
ROUNDS: Final = 200
SETTLED: Final = 1e-10
WIDENING: Final = 1.5
"""Of the prior that new draws are made under: draws of a narrower one have no tails."""


@dataclass(frozen=True)
class DrawSet:
    """Equally weighted draws theta (n, 3) of one subject's posterior under one prior."""

    theta: FloatArray
    prior: PriorSettings | RatioPrior


def shrunken_prior(model: CohortModel, eta: FloatArray, subject: int) -> PriorSettings:
    """Return the prior of theta of one subject within the population, averaged over eta (m, k).

    Each parameter is log-Gaussian with mean and variance of the average, a little wider.
    """
    if isinstance(model.theta_prior, RatioPrior):
        raise ValueError("ratios of two visits are not drawn anew: only theta has a narrower prior")
    mean, spread = population_law(np.log(in_rows(eta)), model.design[subject : subject + 1])
    low, high = bounds(model.theta_prior)
    narrow, wide = np.nextafter(low, high) * 1.0001, np.nextafter(high, low) / 1.0001
    centre = np.clip(np.exp(mean[:, 0].mean(axis=0)), narrow, wide)
    log_sd = WIDENING * np.sqrt((spread**2).mean(axis=0) + mean[:, 0].var(axis=0))
    parameters = {
        name: ParameterPrior(
            centre=float(centre[j]), log_sd=float(log_sd[j]), low=float(low[j]), high=float(high[j])
        )
        for j, name in enumerate(THETA_NAMES)
    }
    return model.theta_prior.model_copy(update=parameters)


def combined(sets: Sequence[DrawSet]) -> RecycledDraws:
    """Return the draws of all sets, weighted to the posterior under the prior of the first.

    A draw's weight is one over the density of the mixture of the sets relative to that posterior,
    sum_s n_s r_s(theta) / c_s, with r_s the ratio of priors and c_s its mean over that posterior.
    """
    theta = np.concatenate([one.theta for one in sets])
    log_first = log_density(theta, sets[0].prior)
    log_ratio = np.stack([log_density(theta, one.prior) - log_first for one in sets])
    log_count = np.log([len(one.theta) for one in sets])
    log_mean = np.zeros(len(sets))
    for _ in range(ROUNDS):
        log_mixture = logsumexp(log_ratio + (log_count - log_mean)[:, None], axis=0)
        found = logsumexp(log_ratio - log_mixture, axis=1)
        found -= found[0]
        settled = np.abs(found - log_mean).max() < SETTLED
        log_mean = found
        if settled:
            break
    log_weight = -logsumexp(log_ratio + (log_count - log_mean)[:, None], axis=0)
    return RecycledDraws(theta, log_weight - logsumexp(log_weight))


def weighted_draws(exact: ExactPosterior) -> tuple[FloatArray, FloatArray]:
    """Return draws phi (n, d) of a posterior and their log weights (n,), which sum to one.

    They are the weighted draws; where the weights failed, the equally weighted ones of MCMC.
    """
    if exact.sampler == MCMC:
        return exact.phi, np.full(len(exact.phi), -np.log(len(exact.phi)))
    return exact.weighted.phi, exact.weighted.log_weight


def redraw_theta(
    model: SpeedModel,
    stored: tuple[FloatArray, FloatArray],
    prior: PriorSettings,
    settings: ExactSettings,
    seed: int,
) -> FloatArray:
    """Draw theta (n, 3) of a subject's exact posterior under another prior of theta.

    The first proposal is fitted to the stored draws phi (n, d) and log weights (n,), reweighted by the ratio
    of the priors.
    """
    phi, log_weight = stored
    theta = phi[:, OF_THETA]
    log_ratio = log_density(theta, prior) - log_density(theta, model.settings.prior.theta)
    joint = model.settings.prior.model_copy(update={"theta": prior})
    narrowed = replace(model, settings=model.settings.model_copy(update={"prior": joint}))
    heart = HeartModel(narrowed)
    placed = placed_in(LogitSpace(joint.simulated), heart.points(phi))
    proposal = fit_in_nearest([placed], log_weight + log_ratio)
    exact, _ = exact_posterior(heart, proposal, settings, seed, "anew")
    return np.asarray(exact.phi[:, OF_THETA])


@dataclass(frozen=True)
class Quantity:
    """What a population is of, theta or its ratios: the prior of its draws, and the hyperpriors."""

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
    """The posterior of a population: draws of it, eta (m, k), and what it makes of the members.

    ``refreshed`` tells how often each member was drawn anew.
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


def infer_population(
    members: Sequence[Member],
    quantity: Quantity,
    settings: HierarchySettings,
    redraw: Redraw | None,
    seed: int,
) -> CohortResult:
    """Infer what the population of some members is like, and each of them within it.

    ``redraw`` draws a member anew; where it is None nobody is. Raises ValueError where there is nobody.
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
        effective = shrink(model, eta, generator(seed, STREAM, "lacking")).effective
        lacking = np.flatnonzero(effective < settings.least_effective).tolist()
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
    )
