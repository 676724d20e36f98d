"""Cohorts without hearts: log theta of each subject is measured with normal errors, so all is known.

The posterior of log theta under a truncated normal prior and a normal likelihood is a truncated normal again,
and its evidence a product of normal probabilities.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import exact_case
import numpy as np
import speed_case
from scipy.special import softmax
from scipy.stats import norm, truncnorm

from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.parameters import ParameterPrior
from swesbi.persons.cohort.cohort import Design, Hyperprior, Member, hyperprior_of, in_rows, make_member
from swesbi.persons.cohort.infer import CohortResult, Redraw, infer_population, of_theta
from swesbi.persons.cohort.model import RecycledDraws, log_normal_mass, population_law
from swesbi.persons.settings import HierarchySettings, HyperpriorSettings, OutlierSettings
from swesbi.prior import BoxPrior, PriorSettings, bounds, draw_prior

THETA_PRIOR = speed_case.shipped().priors["paper"]
ERROR_SD = np.array([0.12, 0.25, 0.3])
"""Of a measurement of log theta: about the widths of the volunteers' posteriors."""
HYPERPRIOR = HyperpriorSettings.from_plain(
    {
        "spread": {"centre": 0.3, "log_sd": 0.6, "low": 0.05, "high": 1.2},
        "age_factor": {"centre": 1.0, "log_sd": 0.1, "low": 0.67, "high": 1.5},
        "sex_factor": {"centre": 1.0, "log_sd": 0.25, "low": 0.37, "high": 2.72},
        "heart_rate_factor": {"centre": 1.0, "log_sd": 0.15, "low": 0.54, "high": 1.83},
        "group_factor": {"centre": 1.0, "log_sd": 0.4, "low": 0.2, "high": 5.0},
    }
)
OUTLIERS = OutlierSettings(not_contradicted=0.02, doubtful=0.2, contradicted=0.9)
EXACT = exact_case.SETTINGS.model_copy(
    update={
        "max_rounds": 20,
        "effective_draws": 1200,
        "min_effective_draws": 400,
        "draws": 2000,
        "mcmc": exact_case.MCMC.model_copy(update={"walkers": 64, "steps": 200}),
    }
)
SETTINGS = HierarchySettings(
    draws=1000,
    rough_draws=150,
    least_effective=50.0,
    refreshes=2,
    shown_draws=500,
    reference_group="",
    outliers=OUTLIERS,
    hyperprior=HYPERPRIOR,
    exact=EXACT,
)

Evidence = Callable[[int, FloatArray, FloatArray], FloatArray]
"""Log evidence (m, d) of each person's data on a parameter, by its number, mean (m, d) and spread (m,)."""
PROPOSED = 100_000
LEAST_EFFECTIVE = 500
POPULATION_DRAWS = 2000


class Priors(NamedTuple):
    """Independent priors of anything."""

    parameters: tuple[ParameterPrior, ...]


def law_of(prior: BoxPrior) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return centre, standard deviation, lower and upper bound of the logarithms, (k,) each."""
    low, high = (np.log(limit) for limit in bounds(prior))
    sd = np.array([parameter.log_sd for parameter in prior.parameters])
    return np.log([parameter.centre for parameter in prior.parameters]), sd, low, high


@dataclass(frozen=True)
class Measured:
    """Measured log theta of d subjects, (d, 3), with errors of these standard deviations, (d, 3)."""

    log_theta: FloatArray
    error_sd: FloatArray

    def posterior(self, subject: int, prior: PriorSettings, draws: int, seed: int) -> FloatArray:
        """Return theta (draws, 3) of a subject's posterior under a prior."""
        centre, prior_sd, low, high = law_of(prior)
        precision = 1.0 / prior_sd**2 + 1.0 / self.error_sd[subject] ** 2
        mean = (centre / prior_sd**2 + self.log_theta[subject] / self.error_sd[subject] ** 2) / precision
        sd = np.tile(1.0 / np.sqrt(precision), (draws, 1))
        log_theta = truncated(mean, sd, low, high, np.random.default_rng(seed))
        return np.asarray(np.exp(np.clip(log_theta, low + 1e-9, high - 1e-9)))

    def log_evidence(self, mean: FloatArray, spread: FloatArray, prior: BoxPrior) -> FloatArray:
        """Return log p(measured | truncated normal), (m, d), of mean (m, d, 3) and spread (m, 3)."""
        _, _, low, high = law_of(prior)
        width = np.broadcast_to(spread[:, None], mean.shape)
        precision = 1.0 / width**2 + 1.0 / self.error_sd**2
        posterior = (mean / width**2 + self.log_theta / self.error_sd**2) / precision
        narrow = 1.0 / np.sqrt(precision)
        together = norm.logpdf(self.log_theta, mean, np.sqrt(width**2 + self.error_sd**2))
        inside = log_normal_mass((low - posterior) / narrow, (high - posterior) / narrow)
        return np.asarray(
            (together + inside - log_normal_mass((low - mean) / width, (high - mean) / width)).sum(axis=-1)
        )


def truncated(
    mean: FloatArray, sd: FloatArray, low: FloatArray, high: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Draw from truncated normals of the shape of their standard deviations."""
    return np.asarray(truncnorm.ppf(rng.random(sd.shape), (low - mean) / sd, (high - mean) / sd, mean, sd))


def contexts(count: int, rng: np.random.Generator, sexes: str = "FM") -> list[Context]:
    """Return contexts of adults at rest."""
    return [
        Context(
            subject=f"s{number}",
            sex=sexes[number % len(sexes)],  # type: ignore[arg-type]
            age_years=float(rng.uniform(20.0, 70.0)),
            bsa_m2=1.8,
            hr_bpm=float(rng.uniform(50.0, 90.0)),
            lvedv_ml=100.0,
            lvesv_ml=40.0,
            ivsd_cm=0.8,
        )
        for number in range(count)
    ]


def blank(cohort: Sequence[Context], groups: Sequence[str] | None = None) -> list[Member]:
    """Return subjects without draws, for what depends on who they are alone."""
    none = np.empty((0, 3))
    named = groups or [""] * len(cohort)
    return [
        Member(context, "not contradicted", group.strip(), none, none)
        for context, group in zip(cohort, named, strict=True)
    ]


def hyperprior(design: Design) -> Hyperprior:
    return hyperprior_of(design, THETA_PRIOR.parameters, HYPERPRIOR)


def draw_members(eta: FloatArray, design: Design, outlier: FloatArray, rng: np.random.Generator) -> Measured:
    """Draw theta (d, 3) of a population of eta (k,), outliers from the prior, and measure it."""
    mean, spread = population_law(np.log(in_rows(eta))[None], design.matrix)
    centre, prior_sd, low, high = law_of(THETA_PRIOR)
    own = truncated(mean[0], np.broadcast_to(spread, mean[0].shape), low, high, rng)
    of_prior = truncated(centre, np.broadcast_to(prior_sd, own.shape), low, high, rng)
    log_theta = np.where((rng.random(len(own)) < outlier)[:, None], of_prior, own)
    error_sd = np.broadcast_to(ERROR_SD, log_theta.shape)
    return Measured(log_theta + error_sd * rng.standard_normal(log_theta.shape), error_sd)


def members_of(
    measured: Measured,
    cohort: Sequence[Context],
    statuses: Sequence[str] | None = None,
    groups: Sequence[str] | None = None,
    draws: int = 4000,
    recycled: int = SETTINGS.draws,
) -> list[Member]:
    """Return the subjects with draws of their posteriors."""
    weight, sizes = np.full(draws, 1.0 / draws), (recycled, EXACT.interval)
    named = zip(
        cohort, statuses or ["not contradicted"] * len(cohort), groups or [""] * len(cohort), strict=True
    )
    return [
        make_member(
            context, status, group, (measured.posterior(number, THETA_PRIOR, draws, number), weight), sizes, 1
        )
        for number, (context, status, group) in enumerate(named)
    ]


def equal_draws(theta: Sequence[FloatArray]) -> tuple[RecycledDraws, ...]:
    """Return equally weighted draws (n, 3) of each subject as what is recycled."""
    return tuple(RecycledDraws(each, np.full(len(each), -np.log(len(each)))) for each in theta)


def redraw_of(measured: Measured, draws: int = SETTINGS.draws) -> Redraw:
    """Return what draws a measured subject anew under a narrower prior."""
    return lambda subject, prior, seed: measured.posterior(int(subject[1:]), prior, draws, seed)


def infer(
    members: Sequence[Member], settings: HierarchySettings, redraw: Redraw | None, seed: int
) -> CohortResult:
    """Infer the population of some subjects."""
    return infer_population(members, of_theta(THETA_PRIOR, settings.hyperprior), settings, redraw, seed)


def draw_eta(prior: Hyperprior, design: Design, evidence: Evidence, rng: np.random.Generator) -> FloatArray:
    """Draw hyperparameters (POPULATION_DRAWS, k) without recycling, where nobody is an outlier.

    Each parameter of theta has its own median, spread and factors, so few hyperparameters at a time are drawn
    from the hyperprior and weighted by an evidence that is known.
    """
    rows = in_rows(draw_prior(prior, PROPOSED, rng))
    mean, spread = population_law(np.log(rows), design.matrix)
    eta = np.empty((POPULATION_DRAWS, *rows.shape[1:]))
    for j in range(3):
        weight = softmax(evidence(j, mean[..., j], spread[:, j]).sum(axis=1))
        assert 1.0 / (weight**2).sum() > LEAST_EFFECTIVE
        eta[..., j] = rows[rng.choice(PROPOSED, POPULATION_DRAWS, p=weight), :, j]
    return eta.reshape(POPULATION_DRAWS, -1)


def closed_form(measured: Measured) -> Evidence:
    """The evidence of a measured log theta."""

    def evidence(j: int, mean: FloatArray, spread: FloatArray) -> FloatArray:
        one = Measured(measured.log_theta[:, j : j + 1], measured.error_sd[:, j : j + 1])
        alone = Priors((THETA_PRIOR.parameters[j],))
        return one.log_evidence(mean[..., None], spread[:, None], alone)

    return evidence


def draw_theta(eta: FloatArray, design: Design, measured: Measured, rng: np.random.Generator) -> FloatArray:
    """Draw theta (n, d, 3) of measured persons, of a population of eta (n, k) each."""
    mean, spread = population_law(np.log(in_rows(eta)), design.matrix)
    own, error = 1.0 / spread[:, None] ** 2, 1.0 / measured.error_sd**2
    middle = (mean * own + measured.log_theta * error) / (own + error)
    _, _, low, high = law_of(THETA_PRIOR)
    return np.exp(truncated(middle, 1.0 / np.sqrt(own + error), low, high, rng))
