"""The likelihood of what a population is like, from recycled draws of its subjects' posteriors.

Given eta, log theta of a subject is normal in each parameter, with the population's spread about a mean that
is linear in its covariates and group, truncated to the box of the prior of theta. The draws theta_n of a
subject's posterior, made under the prior pi, say what its data tell of eta (Hogg, Myers and Bovy 2010, ApJ
725:2166, Eq. 9)::

    p(data | eta) / p(data) = sum_n w_n p(theta_n | eta) / pi(theta_n)

Nuisance parameters and passive stiffness keep their priors, which cancel. What changed between two visits of
a subject is inferred alike, the ratio of both in the place of theta, with a prior of its own (``ratio``).
With a probability given by its verdict a subject is none of the population: then its prior is pi, and the
ratio is one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Final

import numpy as np
from scipy.special import logsumexp
from threadpoolctl import ThreadpoolController

from swesbi.base.arrays import FloatArray
from swesbi.persons.cohort.hyperprior import in_rows
from swesbi.persons.cohort.ratio import LOG_ROOT_TWO_PI, RatioPrior, log_density, log_normal_mass
from swesbi.prior import BoxPrior, PriorSettings, bounds

BLOCK: Final = 256
"""Hyperdraws evaluated together: their matrix of log densities stays within the cache of a core."""


@dataclass(frozen=True)
class RecycledDraws:
    """Draws of one subject's posterior; weights sum to one.

    Attributes:
        theta: Shape (n, 3).
        log_weight: Shape (n,).
    """

    theta: FloatArray
    log_weight: FloatArray


@dataclass(frozen=True)
class PriorAlone:
    """A prior, for what asks a model of a likelihood for its settings."""

    prior: BoxPrior


@dataclass(frozen=True)
class CohortModel:
    """The model of a cohort.

    Attributes:
        settings: The hyperprior.
        recycled: Draws of each of the d subjects.
        design: Rows of the subjects; shape (d, c).
        outlier: Probability of each subject to be none of the population; shape (d,).
        theta_prior: pi, under which the draws were made; of ratios of theta where these are the draws.
    """

    settings: PriorAlone
    recycled: tuple[RecycledDraws, ...]
    design: FloatArray
    outlier: FloatArray
    theta_prior: PriorSettings | RatioPrior

    def log_likelihood(self, phi: FloatArray) -> FloatArray:
        """Return log p(all data | eta) - log p(all data | pi) of eta (m, k); shape (m,)."""
        return np.asarray(self.by_subject(phi).sum(axis=1))

    def by_subject(self, eta: FloatArray) -> FloatArray:
        """Return each subject's part of the log likelihood of eta (m, k), outliers included; (m, d)."""
        parts = [
            [_with_outlier(_log_sum(log_ratio), p) for log_ratio, p in zip(ratios, self.outlier, strict=True)]
            for ratios in self.log_ratios(eta)
        ]
        return np.concatenate([np.stack(columns, axis=1) for columns in parts])

    def log_ratios(self, eta: FloatArray) -> Iterator[Iterator[FloatArray]]:
        """Yield for each block of eta (m, k), subject by subject, log w_n p(theta_n | eta) / pi(theta_n).

        Each is of shape (rows of the block, n). It is quadratic in log theta, so one matrix product gives it.
        """
        for start in range(0, len(eta), BLOCK):
            rows = np.log(in_rows(eta[start : start + BLOCK]))
            yield self._of_block(rows)

    def _of_block(self, rows: FloatArray) -> Iterator[FloatArray]:
        mean, spread = population_law(rows, self.design)
        constant = self._log_constant(mean, spread)
        quadratic = np.broadcast_to((-0.5 / spread**2), mean[:, 0].shape)
        with thread_pools().limit(limits=1):  # sums split over threads differ in the last bit
            for subject, (features, centre) in enumerate(self._features):
                offset = mean[:, subject] - centre
                linear, square = offset / spread**2, -0.5 * (offset / spread) ** 2
                scalar = constant[:, subject] + square.sum(axis=1)
                ones = np.ones(len(rows))
                yield np.column_stack([quadratic, linear, scalar, ones]) @ features

    def _log_constant(self, mean: FloatArray, spread: FloatArray) -> FloatArray:
        """Return the logarithm of the truncated normals' normalising factor, of three each; (m, d)."""
        low, high = (np.log(limit) for limit in bounds(self.theta_prior))
        width = spread[:, None, :]
        log_mass = log_normal_mass((low - mean) / width, (high - mean) / width)
        return np.asarray(-(np.log(width) + LOG_ROOT_TWO_PI + log_mass).sum(axis=-1))

    def thinned(self, draws: int) -> CohortModel:
        """Return the same with about so many draws of each subject, evenly taken: rougher, and faster."""
        thinned = []
        for one in self.recycled:  # at even distances: neighbours may come from one part of a proposal
            chosen = slice(None, None, max(1, len(one.theta) // draws))
            log_weight = one.log_weight[chosen]
            thinned.append(RecycledDraws(one.theta[chosen], log_weight - logsumexp(log_weight)))
        return replace(self, recycled=tuple(thinned))

    @cached_property
    def _features(self) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """Squares and values of log theta about its mean, ones, and log w - log pi; (8, n) a subject."""
        found = []
        for draws in self.recycled:
            log_theta = np.log(draws.theta)
            centre = log_theta.mean(axis=0)
            about = (log_theta - centre).T
            # pi as a density of log theta; p(theta | eta) is one too
            log_prior = log_density(draws.theta, self.theta_prior) + log_theta.sum(axis=1)
            scalars = [np.ones(len(log_theta)), draws.log_weight - log_prior]
            found.append((np.vstack([about**2, about, *scalars]), centre))
        return tuple(found)


@cache
def thread_pools() -> ThreadpoolController:
    """Return what limits the threads of a matrix product; finding the libraries takes a millisecond."""
    return ThreadpoolController()


def population_law(log_rows: FloatArray, design: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean of log theta of each subject, (m, d, 3), and spread, (m, 3).

    Args:
        log_rows: Logarithms of hyperparameters in rows; shape (m, 2 + c, 3).
        design: Shape (d, c).
    """
    slopes = np.einsum("dc,mcj->mdj", design, log_rows[:, 2:])
    return log_rows[:, :1] + slopes, np.exp(log_rows[:, 1])


def _log_sum(log_ratio: FloatArray) -> FloatArray:
    """Return log sum exp over the last axis of (m, n), which is changed."""
    largest = log_ratio.max(axis=1)
    log_ratio -= largest[:, None]
    np.exp(log_ratio, out=log_ratio)
    return np.asarray(largest + np.log(log_ratio.sum(axis=1)))


def _with_outlier(log_ratio: FloatArray, probability: float) -> FloatArray:
    if probability == 0.0:
        return log_ratio
    return np.asarray(np.logaddexp(np.log1p(-probability) + log_ratio, np.log(probability)))
