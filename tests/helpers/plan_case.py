"""Banks of persons without hearts, whose posteriors are known in closed form, and studies made afresh."""

from __future__ import annotations

import hierarchy_case as case
import numpy as np
import ratio_case

from swesbi.arrays import FloatArray
from swesbi.planning.asked import Effect, log_factor
from swesbi.planning.bank import ARMS, Bank, BankPerson, bank_of
from swesbi.planning.hyperdraws import Recycling
from swesbi.planning.settings import GROUPS, PAIRED, PlannedStudiesSettings
from swesbi.prior import bounds

EFFECT = Effect("k_sr_per_s", -0.12)
SPREAD = np.array([0.06, 0.1, 0.1])
"""Of the true log ratio between persons."""
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
BY = Recycling(
    case.THETA_PRIOR, ratio_case.EFFORT, ratio_case.SETTINGS.model_copy(update={"least_effective": 10.0})
)


def log_ratios(number: int, effect: float, rng: np.random.Generator) -> FloatArray:
    """Draw true log ratios (number, 3) about an effect on the parameter asked for."""
    mean = np.zeros((number, 3))
    mean[:, EFFECT.number] = effect
    return ratio_case.true_ratios(mean, SPREAD, rng)


def log_levels(number: int, effect: float, rng: np.random.Generator) -> FloatArray:
    """Draw true log theta (number, 3) of a group about the prior's centre and an effect."""
    centre = np.log([each.centre for each in case.THETA_PRIOR.parameters])
    mean = np.tile(centre, (number, 1))
    mean[:, EFFECT.number] += effect
    low, high = (np.log(limit) for limit in bounds(case.THETA_PRIOR))
    return case.truncated(mean, BETWEEN + 0.0 * mean, low, high, rng)


def level_draws(log_theta: FloatArray, draws: int, seed: int) -> FloatArray:
    """Return draws (d, draws, 3) of theta of persons measured once."""
    rng = np.random.default_rng(seed)
    error_sd = np.broadcast_to(case.ERROR_SD, log_theta.shape)
    measured = case.Measured(log_theta + error_sd * rng.standard_normal(log_theta.shape), error_sd)
    return np.stack(
        [
            measured.posterior(d, case.THETA_PRIOR, draws, 100_000 + 1000 * seed + d)
            for d in range(len(log_theta))
        ]
    )


def bank(number: int, design: str, seed: int, draws: int = STUDIES.recycled_draws) -> Bank:
    """Return a bank of persons, measured with the effect and without."""
    rng = np.random.default_rng(seed)
    values, truth = [], []
    for arm, name in enumerate(ARMS):
        effect = log_factor(EFFECT) if name == "effect" else 0.0
        if design == PAIRED:
            delta = log_ratios(number, effect, rng)
            members = ratio_case.members_of(delta, ("",) * number, 2 * seed + arm)
            values.append(np.stack([member.theta[:draws] for member in members]))
            truth.append(np.exp(delta))
        else:
            log_theta = log_levels(number, effect, rng)
            values.append(level_draws(log_theta, draws, 2 * seed + arm))
            truth.append(np.exp(log_theta))
    both, true = np.stack(values), np.stack(truth)
    called = (both[..., EFFECT.number] < 1.0 / 1.1).mean(axis=-1)
    return bank_of([_person(both, true, called, design, d) for d in range(number)])


def _person(both: FloatArray, true: FloatArray, called: FloatArray, design: str, d: int) -> BankPerson:
    told = np.full((2, 3), np.nan)
    if design == PAIRED:
        told = np.zeros((2, 3))
        told[:, EFFECT.number] = called[:, d]
    one, zero = np.ones(2), np.zeros((2, 3))
    return BankPerson(d, both[:, d], true[:, d], zero if design == PAIRED else told, told, told, one, one, 0)


__all__ = ["BY", "EFFECT", "GROUPS", "PAIRED", "STUDIES", "bank", "level_draws", "log_levels", "log_ratios"]
