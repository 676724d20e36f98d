"""Chance variation of a bank's persons, and how far their likelihoods are moved to undo it.

By chance a bank's persons respond a little more or less than the population, and their recordings err a
little to one side. What all persons have in common of that does not average out over the studies drawn from
them: where a study of n persons just has its power, chance variation of the bank of N moves the middle of its
test by sqrt(n / N) standard errors. Two things are known of it and are taken off, as control variates are:

- each person's true response r, whose mean in the population is the logarithm of the effect;
- of pairs the person's answer x without the effect, whose mean is 0 since visits nothing lies between may be
  exchanged. Both arms are recorded with the same errors (``planning.persons``), so that a bank errs in
  both alike; groups are both drawn from the bank, where such errors cancel by themselves.

With y the answer with the effect, likelihoods with the effect are moved along the log parameter by

    c = (log effect - mean r) - b mean x,

b being the slope of y - r on x by least squares, within [0, 1]. Answers are middles of likelihoods: under a
normal prior of mean m and variance v a posterior of mean a and variance s is that of a normal likelihood
about m + (a - m) / k, of variance s / k, where k = 1 - s / v. Means are weighted as persons count in a
population of a usual spread.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import FloatArray
from swesbi.persons.planning.bank import ARMS, EFFECT, NONE, Bank
from swesbi.persons.planning.effect import Effect, log_factor
from swesbi.persons.planning.hyperdraws import StudyAnalysis
from swesbi.persons.planning.settings import PAIRED
from swesbi.prior import even_quantiles

LEAST_CONTRACTION: Final = 0.2
"""Of k: a posterior as wide as the prior has no likelihood whose middle could be told."""


@dataclass(frozen=True)
class Chance:
    """What a bank's persons show beside what the population would; in logarithms, shape (N,) each.

    Attributes:
        response: True response less the effect.
        treated: Answer with the effect, less the true response.
        untreated: Answer without, whose mean is known to be 0; None where it is not.
        weight: How much a person counts.
    """

    response: FloatArray
    treated: FloatArray
    untreated: FloatArray | None
    weight: FloatArray

    def displacement(self, persons: NDArray[np.int_]) -> float:
        """Return c of the bank that some persons make, by their places; one may be there several times."""
        weight = self.weight[persons] / self.weight[persons].sum()
        moved = -float(weight @ self.response[persons])
        if self.untreated is None:
            return moved
        without, treated = self.untreated[persons], self.treated[persons]
        return moved - _slope(without, treated, weight) * float(weight @ without)


def _slope(x: FloatArray, y: FloatArray, weight: FloatArray) -> float:
    """Return the slope of y on x, (N,) each, within [0, 1]; 0 where x does not vary."""
    about = x - weight @ x
    variance = float(weight @ about**2)
    return float(np.clip(weight @ (about * y) / variance, 0.0, 1.0)) if variance > 0.0 else 0.0


def chance_of(bank: Bank, design: str, effect: Effect, by: StudyAnalysis) -> Chance:
    """Return the chance variation of a bank's persons.

    Args:
        bank: The persons.
        design: ``paired`` or ``groups``.
        effect: What happened to them.
        by: The prior of theta, and the hyperprior whose spread between persons is the usual one.
    """
    of_design = by.changes.hyperprior if design == PAIRED else by.cohort.hyperprior
    number, with_effect, without = effect.number, ARMS.index(EFFECT), ARMS.index(NONE)
    log_prior = np.log(even_quantiles(by.theta)[:, number])
    middle, variance = _likelihoods(np.log(bank.values[..., number]), design, log_prior)
    truth = np.log(bank.truth[..., number])
    response = truth[with_effect] - truth[without]
    return Chance(
        response=response - log_factor(effect),
        treated=middle[with_effect] - response,
        untreated=middle[without] if design == PAIRED else None,
        weight=1.0 / (variance.mean(axis=0) + of_design.spread.centre**2),
    )


def _likelihoods(log_draws: FloatArray, design: str, log_prior: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return middle and variance (2, N) of likelihoods, by draws (2, N, n) and prior's (q,) at a visit."""
    of_visit = float(log_prior.var())
    mean, variance = (0.0, 2.0 * of_visit) if design == PAIRED else (float(log_prior.mean()), of_visit)
    spread = log_draws.var(axis=-1)
    told = np.clip(1.0 - spread / variance, LEAST_CONTRACTION, 1.0)
    return mean + (log_draws.mean(axis=-1) - mean) / told, spread / told
