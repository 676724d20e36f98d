"""Banks of persons without hearts, whose posteriors are known in closed form, and studies made afresh."""

from __future__ import annotations

import hierarchy_case as case
import numpy as np
import ratio_case

from swesbi.base.arrays import FloatArray
from swesbi.persons.planning.bank import ARMS, Bank
from swesbi.persons.planning.effect import Effect, log_factor
from swesbi.persons.planning.likelihoods import StudyAnalysis
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
STUDIES = PlannedStudiesSettings(sizes=(4, 8, 16, 32), studies=200, resamples=10)
DRAWS = 300
BY = StudyAnalysis(case.THETA_PRIOR, ratio_case.EFFORT, ratio_case.SETTINGS)


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


def drawn(number: int, design: str, seed: int, draws: int = DRAWS) -> tuple[FloatArray, FloatArray]:
    """Return draws (2, number, draws, 3) and truth (2, number, 3), without the effect and with it."""
    rng = np.random.default_rng(seed)
    first, none, further = rng.standard_normal((3, number, 3))
    errors = (none, ALIKE * none + np.sqrt(1.0 - ALIKE**2) * further)
    base = log_ratios(number, 0.0, rng) if design == PAIRED else log_levels(number, 0.0, rng)
    truth = np.stack([base, base + responses(number, log_factor(EFFECT), rng)])
    both = zip(truth, errors, strict=True)
    if design == PAIRED:
        values = [ratio_draws(true, np.stack([first, error]), draws, seed) for true, error in both]
    else:
        values = [level_draws(true, error, draws, seed) for true, error in both]
    return np.stack(values), np.exp(truth)


def bank(number: int, design: str, seed: int, draws: int = DRAWS) -> Bank:
    """Return a bank of persons, measured with the effect and without as `plan` does."""
    return bank_of_draws(*drawn(number, design, seed, draws), design)


def bank_of_draws(values: FloatArray, truth: FloatArray, design: str) -> Bank:
    """Return the bank of persons with draws (2, N, n, 3) and true values (2, N, 3)."""
    log_values, number = np.log(values), values.shape[1]
    called = np.full(truth.shape, np.nan)
    if design == PAIRED:
        called = (values < 1.0 / 1.1).mean(axis=2)
    about = log_values - log_values.mean(axis=2, keepdims=True)
    covariance = np.einsum("andi,andj->anij", about, about) / (values.shape[2] - 1)
    mean, covariance, true, fallen = (
        each.swapaxes(0, 1) for each in (log_values.mean(axis=2), covariance, truth, called)
    )
    ones = np.ones((number, len(ARMS)))
    return Bank(
        arm=ARMS,
        number=np.arange(float(number)),
        mean=mean,
        covariance=covariance,
        truth=true,
        risen=0.0 * fallen,
        fallen=fallen,
        detectable=fallen,
        efficiency=ones,
        converged=ones,
        redrawn=np.zeros(number),
    )
