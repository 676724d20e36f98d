"""Banks of persons without hearts, whose posteriors are known in closed form, and studies made afresh."""

from __future__ import annotations

import hierarchy_case as case
import numpy as np
import ratio_case

from swesbi.base.arrays import FloatArray
from swesbi.persons.planning.effect import Effect, log_factor
from swesbi.persons.planning.likelihoods import StudyAnalysis
from swesbi.persons.planning.simulation import ARMS, Bank
from swesbi.persons.settings import PAIRED, PlannedStudiesSettings

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
    centre, _, low, high = case.law_of(case.THETA_PRIOR)
    own = case.truncated(centre, np.tile(BETWEEN, (number, 1)), low, high, rng)
    return own + responses(number, effect, rng)


def responses(number: int, effect: float, rng: np.random.Generator) -> FloatArray:
    """Draw true log responses (number, 3), zero but in the parameter asked for."""
    found = np.zeros((number, 3))
    if effect != 0.0:
        found[:, EFFECT.number] = effect + RESPONSE_SPREAD * rng.standard_normal(number)
    return found


def ratio_draws(delta: FloatArray, errors: FloatArray, draws: int, seed: int) -> FloatArray:
    """Return draws (d, draws, 3) of the ratio of persons measured twice with errors (2, d, 3) in sd."""
    both = zip(ratio_case.visits(delta, np.random.default_rng(seed)), errors, strict=True)
    visits = [ratio_case.with_errors(*each) for each in both]
    streams = 10_000_000 * seed + 2 * np.arange(len(delta))
    return np.stack(
        [
            ratio_case.ratio_draws(visits, d, draws, (stream + 1, stream))
            for d, stream in enumerate(streams.tolist())
        ]
    )


def level_draws(log_theta: FloatArray, errors: FloatArray, draws: int, seed: int) -> FloatArray:
    """Return draws (d, draws, 3) of theta of persons measured once with errors (d, 3) in sd."""
    measured = ratio_case.with_errors(log_theta, errors, case.ERROR_SD)
    stream = 100_000 + 1000 * seed
    return np.stack(
        [measured.posterior(d, case.THETA_PRIOR, draws, stream + d) for d in range(len(log_theta))]
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
    log_values, number = np.log(values).swapaxes(0, 1), values.shape[1]
    about = log_values - log_values.mean(axis=2, keepdims=True)
    below = (values < 1.0 / 1.1).mean(axis=2).swapaxes(0, 1)
    fallen = below if design == PAIRED else np.full_like(below, np.nan)
    ones = np.ones((number, len(ARMS)))
    return Bank(
        arm=ARMS,
        number=np.arange(float(number)),
        mean=log_values.mean(axis=2),
        covariance=np.einsum("nadi,nadj->naij", about, about) / (values.shape[2] - 1),
        truth=truth.swapaxes(0, 1),
        risen=0.0 * fallen,
        fallen=fallen,
        detectable=fallen,
        efficiency=ones,
        converged=ones,
        redrawn=np.zeros(number),
    )
