"""Banks of persons without hearts, whose posteriors are known in closed form, and studies made afresh."""

from __future__ import annotations

import hierarchy_case as case
import numpy as np
import ratio_case

from swesbi.base.arrays import FloatArray
from swesbi.persons.cohort.model import CohortModel, PriorAlone, RecycledDraws
from swesbi.persons.cohort.ratio import RatioPrior
from swesbi.persons.planning.bank import Bank, BankPerson, bank_of
from swesbi.persons.planning.effect import Effect, log_factor
from swesbi.persons.planning.hyperdraws import Likelihoods, StudyAnalysis, planned_design
from swesbi.persons.planning.settings import PAIRED, PlannedStudiesSettings
from swesbi.prior import bounds

EFFECT = Effect("k_sr_per_s", -0.12)
VISIT_SPREAD = np.array([0.06, 0.1, 0.07])
"""Of the true log ratio between persons, from visit to visit."""
RESPONSE_SPREAD = 0.07
"""Of the true log response between persons."""
ALIKE = 0.8
"""Correlation of the errors of one visit's recording without the effect and with it, of one day and noise."""
BETWEEN = np.array([0.2, 0.25, 0.2])
"""Of log theta between persons who came once."""
STUDIES = PlannedStudiesSettings(
    sizes=(4, 8, 16, 32),
    proposal_sizes=(6, 16, 36),
    hyperdraws=1500,
    recycled_draws=300,
    studies=200,
    resamples=10,
    least_effective=30.0,
)
BY = StudyAnalysis(
    case.THETA_PRIOR, ratio_case.EFFORT, ratio_case.SETTINGS.model_copy(update={"least_effective": 10.0})
)


def log_ratios(number: int, effect: float, rng: np.random.Generator) -> FloatArray:
    """Draw true log ratios (number, 3) of persons to whom an effect happens, or none."""
    return ratio_case.true_ratios(responses(number, effect, rng), VISIT_SPREAD, rng)


def log_levels(number: int, effect: float, rng: np.random.Generator) -> FloatArray:
    """Draw true log theta (number, 3) about the prior's centre, moved by an effect, or none."""
    centre = np.log([each.centre for each in case.THETA_PRIOR.parameters])
    mean = np.tile(centre, (number, 1))
    low, high = (np.log(limit) for limit in bounds(case.THETA_PRIOR))
    return case.truncated(mean, BETWEEN + 0.0 * mean, low, high, rng) + responses(number, effect, rng)


def responses(number: int, effect: float, rng: np.random.Generator) -> FloatArray:
    """Draw true log responses (number, 3), zero but in the parameter asked for."""
    found = np.zeros((number, 3))
    if effect != 0.0:
        found[:, EFFECT.number] = effect + RESPONSE_SPREAD * rng.standard_normal(number)
    return found


def ratio_draws(delta: FloatArray, errors: FloatArray, draws: int, seed: int) -> FloatArray:
    """Return draws (d, draws, 3) of the ratio of persons measured twice with errors (2, d, 3) in sd."""
    both = ratio_case.visits(delta, np.random.default_rng(seed))
    error_sd = ratio_case.ERROR_SD + 0.0 * delta
    earlier, later = (
        case.Measured(log_theta + error_sd * error, error_sd)
        for log_theta, error in zip(both, errors, strict=True)
    )
    return np.stack(
        [
            later.posterior(d, case.THETA_PRIOR, draws, 10_000_000 * seed + 2 * d)
            / earlier.posterior(d, case.THETA_PRIOR, draws, 10_000_000 * seed + 2 * d + 1)
            for d in range(len(delta))
        ]
    )


def level_draws(log_theta: FloatArray, errors: FloatArray, draws: int, seed: int) -> FloatArray:
    """Return draws (d, draws, 3) of theta of persons measured once with errors (d, 3) in sd."""
    error_sd = np.broadcast_to(case.ERROR_SD, log_theta.shape)
    measured = case.Measured(log_theta + error_sd * errors, error_sd)
    return np.stack(
        [
            measured.posterior(d, case.THETA_PRIOR, draws, 100_000 + 1000 * seed + d)
            for d in range(len(log_theta))
        ]
    )


def bank(number: int, design: str, seed: int, draws: int = STUDIES.recycled_draws) -> Bank:
    """Return a bank of persons, measured with the effect and without as `plan` does."""
    rng = np.random.default_rng(seed)
    first, none, further = rng.standard_normal((3, number, 3))
    errors = (none, ALIKE * none + np.sqrt(1.0 - ALIKE**2) * further)
    drawn = log_ratios(number, 0.0, rng) if design == PAIRED else log_levels(number, 0.0, rng)
    truth = np.stack([drawn, drawn + responses(number, log_factor(EFFECT), rng)])
    if design == PAIRED:
        values = [
            ratio_draws(true, np.stack([first, error]), draws, seed)
            for true, error in zip(truth, errors, strict=True)
        ]
    else:
        values = [level_draws(true, error, draws, seed) for true, error in zip(truth, errors, strict=True)]
    both = np.stack(values)
    called = (both[..., EFFECT.number] < 1.0 / 1.1).mean(axis=-1)
    return bank_of([_person(both, np.exp(truth), called, design, d) for d in range(number)])


def fresh_draws(number: int, seed: int, draws: int) -> FloatArray:
    """Return draws (number, draws, 3) of the ratio of further persons with the effect."""
    rng = np.random.default_rng(seed)
    return ratio_draws(
        log_ratios(number, log_factor(EFFECT), rng), rng.standard_normal((2, number, 3)), draws, seed
    )


def by_person(ratios: FloatArray, likelihoods: Likelihoods, made_at: FloatArray | None = None) -> FloatArray:
    """Return the log likelihoods (m, N) of further persons at the hyperdraws of others.

    Args:
        ratios: Draws (N, n, 3).
        likelihoods: Of the others.
        made_at: Where the prior had the draws, if they were moved since.
    """
    prior = RatioPrior(BY.theta)
    weight = np.full(ratios.shape[:2], -np.log(ratios.shape[1]))
    if made_at is not None:
        there, here = (prior_of_log(each, prior) for each in (ratios, made_at))
        weight += there - here
    model = CohortModel(
        settings=PriorAlone(likelihoods.prior),
        recycled=tuple(RecycledDraws(*each) for each in zip(ratios, weight, strict=True)),
        design=planned_design(PAIRED, [True] * len(ratios)).matrix,
        outlier=np.full(len(ratios), BY.cohort.outliers.not_contradicted),
        theta_prior=prior,
    )
    return model.by_subject(likelihoods.eta)


def prior_of_log(ratios: FloatArray, prior: RatioPrior) -> FloatArray:
    """Return the log prior density (N, n), per unit of the log ratio, of draws (N, n, 3)."""
    return np.stack([prior.log_density(each) + np.log(each).sum(axis=1) for each in ratios])


def _person(both: FloatArray, true: FloatArray, called: FloatArray, design: str, d: int) -> BankPerson:
    told = np.full((2, 3), np.nan)
    if design == PAIRED:
        told = np.zeros((2, 3))
        told[:, EFFECT.number] = called[:, d]
    one, zero = np.ones(2), np.zeros((2, 3))
    return BankPerson(d, both[:, d], true[:, d], zero if design == PAIRED else told, told, told, one, one, 0)
