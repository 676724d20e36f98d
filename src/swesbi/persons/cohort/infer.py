"""The posterior of a cohort: recycled draws, its exact posterior, draws anew where too few are left."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from swesbi.artefacts.csv import PlainTable
from swesbi.artefacts.typed import BySubject
from swesbi.base.arrays import FloatArray
from swesbi.base.progress import LOGGER, Progress
from swesbi.base.settings import Settings
from swesbi.draws import interval_levels
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, speed_model
from swesbi.parameters import OF_THETA, THETA, ParameterPrior
from swesbi.persons.cohort.cohort import (
    COVARIATES,
    Design,
    Hyperprior,
    Member,
    design_of,
    hyperprior_of,
    in_rows,
    make_member,
    weighted_quantiles,
)
from swesbi.persons.cohort.model import (
    CohortModel,
    DrawSet,
    PriorAlone,
    RatioPrior,
    Shrinkage,
    combined,
    log_density,
    shrink,
    shrunken_prior,
)
from swesbi.persons.cohort.stored import (
    NOTE_SEPARATOR,
    CohortPosterior,
    Members,
    Population,
    hyperparameter_table,
    subject_table,
)
from swesbi.persons.settings import HierarchySettings, HyperpriorSettings, RatioHyperpriorSettings
from swesbi.posterior.adaptive import adapted
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.fitted import fit_in_nearest, placed_in
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.importance import resample
from swesbi.posterior.result import MCMC, ExactPosterior
from swesbi.posterior.settings import ExactSettings, asking
from swesbi.posterior.space import LogitSpace, PlacedProposal, log_posterior_of_logit
from swesbi.prior import PriorSettings, to_logit
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.seeds import generator, integer_seed
from swesbi.verdict.verdict import Verdict

MANY: Final = 100
"""Subjects from which the way from the hyperprior is sought by a rough likelihood first, to save time."""
STREAM: Final = "cohort posterior"
PILOT_DRAWS: Final = 400
"""Draws of the population, effective ones too, by which subjects are found that lack draws."""
Redraw = Callable[[str, PriorSettings, int], FloatArray]
"""Draws theta (n, 3) anew of a subject's posterior under another prior of theta, by a seed."""


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


def stored_form(inferred: CohortResult, notes: Sequence[str] = ()) -> CohortPosterior:
    """Return what is stored of the posterior of a population; ``notes`` are put before its own."""
    design, exact, prior = inferred.design, inferred.exact, inferred.prior
    rows = in_rows(inferred.eta)[None]
    first_group = 2 + len(design.covariates)
    log_posterior = log_posterior_of_logit(inferred.model, to_logit(inferred.eta, prior))
    return CohortPosterior(
        member=tuple(member.subject for member in inferred.members),
        verdict=tuple(member.status for member in inferred.members),
        group=tuple(member.group for member in inferred.members),
        unit=inferred.quantity.units,
        covariate=design.covariates,
        compared_group=design.groups[1:],
        hyperparameter=prior.names,
        reference_group=design.groups[0] if design.groups else "",
        interval_mass=exact.interval_mass,
        sampler=exact.sampler,
        reasons=NOTE_SEPARATOR.join(exact.reasons),
        converged=exact.converged,
        k_hat=exact.k_hat,
        efficiency=exact.efficiency,
        effective_draws=exact.effective_draws,
        notes=NOTE_SEPARATOR.join((*notes, *design.notes)),
        hyperprior=np.array([[each.centre, each.log_sd, each.low, each.high] for each in prior.parameters]),
        log_posterior=log_posterior[None],
        design=design.matrix,
        covariate_centre=design.centres,
        population=Population(
            median=rows[:, :, 0],
            spread=rows[:, :, 1],
            covariate_factor=rows[:, :, 2:first_group],
            group_factor=rows[:, :, first_group:],
            within=_drawn_within(inferred)[None],
        ),
        members=_members(inferred),
        log_likelihood=inferred.shrinkage.log_likelihood[None],
    )


def _drawn_within(inferred: CohortResult) -> FloatArray:
    """Return draws of each member's quantity within the population; shape (m, d, 3)."""
    drawn = zip(inferred.model.recycled, inferred.shrinkage.rows.T, strict=True)
    return np.stack([draws.theta[rows] for draws, rows in drawn], axis=1)


def _members(inferred: CohortResult) -> Members:
    levels, shrinkage = np.insert(interval_levels(inferred.exact.interval_mass), 1, 0.5), inferred.shrinkage
    after = zip(inferred.model.recycled, shrinkage.weights, strict=True)
    return Members(
        before=np.stack([one.alone for one in inferred.members]),
        after=np.stack([weighted_quantiles(draws.theta, weight, levels) for draws, weight in after]),
        effective_draws=shrinkage.effective,
        refreshed=np.array(inferred.refreshed),
        outlier_prior=inferred.model.outlier,
        outlier_posterior=shrinkage.outlier,
    )


class VisitSettings(Settings):
    """Whose recording one is: name of the person, and of the person's group; empty where none is given."""

    person: str
    group: str


NOBODY = VisitSettings(person="", group="")


class OfCohort(NamedTuple):
    """The posterior of a cohort, with a row a hyperparameter, and a row a subject and parameter."""

    cohort_posterior: CohortPosterior
    table: PlainTable
    subjects: PlainTable


def posterior_of_cohort(
    posteriors: BySubject[ExactPosterior],
    verdicts: BySubject[Verdict],
    observations: BySubject[Observation],
    noise: CohortNoise,
    *,
    model: SpeedModelSettings,
    exact: ExactSettings,
    cohort_posterior: HierarchySettings,
    visits: dict[str, VisitSettings],
    seed: int,
) -> OfCohort:
    """Infer medians, spreads, slopes and differences of groups from the posteriors of all subjects.

    A person with several visits counts once, with the first of them in the table of subjects.

    ``exact`` is of a posterior that is drawn anew. Raises ValueError where no subject has a posterior, or is
    of the reference group.
    """
    first, notes = first_visits(list(posteriors), visits)
    progress = Progress("posteriors of the cohort", len(first), unit="subject")
    members = []
    for subject in first:
        phi, log_weight = weighted_draws(posteriors[subject])
        members.append(
            make_member(
                observations[subject].context,
                verdicts[subject].status,
                visits.get(subject, NOBODY).group,
                (phi[:, OF_THETA], np.exp(log_weight)),
                (cohort_posterior.draws, cohort_posterior.exact.interval),
                seed,
            )
        )
        progress.step()

    def redraw(subject: str, prior: PriorSettings, seed: int) -> FloatArray:
        LOGGER.info("subject %s: too few recycled draws lie where the population does; drawn anew", subject)
        recorded = speed_model(observations[subject], noise, model)
        return redraw_theta(recorded, weighted_draws(posteriors[subject]), prior, exact, seed)

    quantity = of_theta(model.prior.theta, cohort_posterior.hyperprior)
    stored = stored_form(infer_population(members, quantity, cohort_posterior, redraw, seed), notes)
    _report(stored)
    return OfCohort(stored, hyperparameter_table(stored), subject_table(stored))


def first_visits(
    subjects: Sequence[str], visits: Mapping[str, VisitSettings]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the first recording of each person, in order, and what is to be said of those left out."""
    of_person = {visits.get(subject, NOBODY).person or subject: subject for subject in reversed(subjects)}
    first = tuple(subject for subject in subjects if subject in of_person.values())
    later = [subject for subject in subjects if subject not in first]
    note = f"a person counts once, with the first visit; left out as later visits: {', '.join(later)}"
    return first, (note,) if later else ()


def _report(posterior: CohortPosterior) -> None:
    LOGGER.info(
        "%d subjects: draws by %s; k-hat %.2f, efficiency %.0f %%; drawn anew: %d",
        len(posterior.member), posterior.sampler, posterior.k_hat, 100.0 * posterior.efficiency,
        int((posterior.members.refreshed > 0).sum()),
    )  # fmt: skip
    for sentence in filter(None, (posterior.notes, posterior.reasons)):
        LOGGER.info("  %s", sentence)
