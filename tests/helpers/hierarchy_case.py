"""Cohorts without hearts: log theta of each subject is measured with normal errors, so all is known.

The posterior of log theta under a truncated normal prior and a normal likelihood is a truncated normal again,
and its evidence a product of normal probabilities.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm, truncnorm

from swesbi.context import Context
from swesbi.persons.cohort.cohort import Design, Member, make_member
from swesbi.persons.cohort.hyperprior import in_rows
from swesbi.persons.cohort.infer import CohortResult, Redraw, infer_population, of_theta
from swesbi.persons.cohort.model import RecycledDraws, population_law
from swesbi.persons.cohort.ratio import log_normal_mass
from swesbi.persons.cohort.settings import HierarchySettings, HyperpriorSettings, OutlierSettings
from swesbi.posterior.settings import ExactSettings, McmcSettings
from swesbi.prior import PriorSettings, bounds

FloatArray = NDArray[np.float64]
THETA_PRIOR = PriorSettings.from_plain(
    {
        "k0_kpa": {"centre": 45.0, "log_sd": 0.5, "low": 10.0, "high": 200.0},
        "k_atp_per_s": {"centre": 5.0, "log_sd": 0.6, "low": 2.0, "high": 30.0},
        "k_sr_per_s": {"centre": 30.0, "log_sd": 0.45, "low": 2.0, "high": 60.0},
    }
)
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
EXACT = ExactSettings(
    first_draws=1000,
    prior_fraction=0.1,
    round_draws=1500,
    max_rounds=20,
    effective_draws=1200,
    min_effective_draws=400,
    max_k_hat=0.7,
    draws=2000,
    interval=0.9,
    mcmc=McmcSettings(
        ensembles=4,
        walkers=64,
        steps=200,
        max_steps=4000,
        warm_up_fraction=0.25,
        max_r_hat=1.01,
        min_effective_draws=1000,
    ),
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


@dataclass(frozen=True)
class Measured:
    """Measured log theta of d subjects, (d, 3), with errors of these standard deviations, (d, 3)."""

    log_theta: FloatArray
    error_sd: FloatArray

    def posterior(self, subject: int, prior: PriorSettings, draws: int, seed: int) -> FloatArray:
        """Return theta (draws, 3) of a subject's posterior under a prior."""
        mean, sd = self.law(subject, prior)
        low, high = (np.log(limit) for limit in bounds(prior))
        levels = np.random.default_rng(seed).random((draws, 3))
        log_theta = truncnorm.ppf(levels, (low - mean) / sd, (high - mean) / sd, mean, sd)
        return np.asarray(np.exp(np.clip(log_theta, low + 1e-9, high - 1e-9)))

    def law(self, subject: int, prior: PriorSettings) -> tuple[FloatArray, FloatArray]:
        """Return mean and standard deviation, (3,), of the normal that the posterior truncates."""
        centre = np.log([parameter.centre for parameter in prior.parameters])
        prior_sd = np.array([parameter.log_sd for parameter in prior.parameters])
        precision = 1.0 / prior_sd**2 + 1.0 / self.error_sd[subject] ** 2
        mean = centre / prior_sd**2 + self.log_theta[subject] / self.error_sd[subject] ** 2
        return mean / precision, 1.0 / np.sqrt(precision)

    def log_evidence(self, mean: FloatArray, spread: FloatArray, prior: PriorSettings) -> FloatArray:
        """Return log p(measured | truncated normal), (m, d), of mean (m, d, 3) and spread (m, 3)."""
        low, high = (np.log(limit) for limit in bounds(prior))
        width = np.broadcast_to(spread[:, None], mean.shape)
        precision = 1.0 / width**2 + 1.0 / self.error_sd**2
        posterior = (mean / width**2 + self.log_theta / self.error_sd**2) / precision
        narrow = 1.0 / np.sqrt(precision)
        together = norm.logpdf(self.log_theta, mean, np.sqrt(width**2 + self.error_sd**2))
        inside = log_normal_mass((low - posterior) / narrow, (high - posterior) / narrow)
        return np.asarray(
            (together + inside - log_normal_mass((low - mean) / width, (high - mean) / width)).sum(axis=-1)
        )


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


def draw_members(
    eta: FloatArray, design: Design, outlier: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, Measured]:
    """Draw true theta (d, 3) of a population of eta (k,), outliers from the prior, and measure it."""
    mean, spread = population_law(np.log(in_rows(eta))[None], design.matrix)
    low, high = (np.log(limit) for limit in bounds(THETA_PRIOR))
    own = truncated(mean[0], np.broadcast_to(spread, mean[0].shape), low, high, rng)
    centre = np.log([parameter.centre for parameter in THETA_PRIOR.parameters])
    prior_sd = np.array([parameter.log_sd for parameter in THETA_PRIOR.parameters])
    of_prior = truncated(
        np.broadcast_to(centre, own.shape), np.broadcast_to(prior_sd, own.shape), low, high, rng
    )
    log_theta = np.where((rng.random(len(own)) < outlier)[:, None], of_prior, own)
    error_sd = np.broadcast_to(ERROR_SD, log_theta.shape)
    measured = log_theta + error_sd * rng.standard_normal(log_theta.shape)
    return np.exp(log_theta), Measured(measured, error_sd)


def truncated(
    mean: FloatArray, sd: FloatArray, low: FloatArray, high: FloatArray, rng: np.random.Generator
) -> FloatArray:
    levels = rng.random(mean.shape)
    return np.asarray(truncnorm.ppf(levels, (low - mean) / sd, (high - mean) / sd, mean, sd))


def members_of(
    measured: Measured,
    cohort: Sequence[Context],
    statuses: Sequence[str],
    groups: Sequence[str],
    draws: int,
    recycled: int = SETTINGS.draws,
) -> list[Member]:
    """Return the subjects with draws of their posteriors."""
    weight, sizes = np.full(draws, 1.0 / draws), (recycled, EXACT.interval)
    return [
        make_member(
            context, status, group, (measured.posterior(number, THETA_PRIOR, draws, number), weight), sizes, 1
        )
        for number, (context, status, group) in enumerate(zip(cohort, statuses, groups, strict=True))
    ]


def equal_draws(theta: Sequence[FloatArray]) -> tuple[RecycledDraws, ...]:
    """Return equally weighted draws (n, 3) of each subject as what is recycled."""
    return tuple(RecycledDraws(each, np.full(len(each), -np.log(len(each)))) for each in theta)


def infer(
    members: Sequence[Member], settings: HierarchySettings, redraw: Redraw | None, seed: int
) -> CohortResult:
    """Infer the population of some subjects."""
    return infer_population(members, of_theta(THETA_PRIOR, settings.hyperprior), settings, redraw, seed)
