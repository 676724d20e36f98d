"""The likelihood of what a population is like, from recycled draws of its subjects' posteriors.

Given eta, log theta of a subject is normal in each parameter, with the population's spread about a mean that
is linear in its covariates and group, truncated to the box of the prior of theta. The draws theta_n of a
subject's posterior, made under the prior pi, say what its data tell of eta (Hogg, Myers and Bovy 2010, ApJ
725:2166, Eq. 9)::

    p(data | eta) / p(data) = sum_n w_n p(theta_n | eta) / pi(theta_n)

Nuisance parameters and passive stiffness keep their priors, which cancel. What changed between two visits of
a subject is inferred alike, the ratio of both in the place of theta, with a prior of its own.
With a probability given by its verdict a subject is none of the population: then its prior is pi, and the
ratio is one.

A subject's posterior is drawn anew under a narrower prior of theta, near what the population says of it.
Old and new draws together are then weighted to the posterior under the first prior: each counts as if it came
from the mixture of all sets (balance heuristic, Veach and Guibas 1995). The sets differ in their priors
alone, so all that is unknown of the mixture is the evidence under each, which the draws themselves give
(Geyer's reverse logistic regression; Shirts and Chodera 2008, J Chem Phys 129:124105, Eq. 11).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr, logsumexp
from threadpoolctl import ThreadpoolController

from swesbi.base.arrays import FloatArray
from swesbi.parameters import THETA_NAMES, ParameterPrior
from swesbi.persons.cohort.cohort import in_rows
from swesbi.prior import BoxPrior, PriorSettings, bounds, in_bounds
from swesbi.prior import log_density as log_density_of_box

BLOCK: Final = 256
"""Hyperdraws evaluated together: their matrix of log densities stays within the cache of a core."""
ROOT_TWO: Final = float(np.sqrt(2.0))
LOG_ROOT_TWO_PI: Final = 0.5 * float(np.log(2.0 * np.pi))
ROUNDS: Final = 200
SETTLED: Final = 1e-10
WIDENING: Final = 1.5
"""Of the prior that new draws are made under: draws of a narrower one have no tails."""


@dataclass(frozen=True)
class RatioPrior:
    """The prior of the ratio of theta at two visits, by the prior of theta at each of them.

    Of theta no part is shared between the visits of a person, so log theta at both is independent under the
    prior: normal about m with standard deviation s, truncated to [l, h]. Their difference delta then has the
    density of the convolution, with Z the mass between the bounds and phi, Phi of the standard normal::

        pi(delta) = phi(delta / (sqrt(2) s)) / (sqrt(2) s)
                    (Phi((u - c) sqrt(2) / s) - Phi((d - c) sqrt(2) / s)) / Z^2,

    where log theta of the later visit lies between d = max(l, l + delta) and u = min(h, h + delta), about
    c = m + delta / 2.
    """

    theta: PriorSettings

    @property
    def parameters(self) -> tuple[ParameterPrior, ...]:
        """Bounds of each ratio, with centre and standard deviation of it before truncation."""
        return tuple(
            ParameterPrior(
                centre=1.0,
                log_sd=ROOT_TWO * each.log_sd,
                low=each.low / each.high,
                high=each.high / each.low,
            )
            for each in self.theta.parameters
        )

    def log_density(self, ratio: FloatArray) -> FloatArray:
        """Return log p(ratio), per unit of the ratio, of ratios (n, 3); -inf outside the bounds; (n,)."""
        inside = in_bounds(ratio, self)
        log_ratio = np.log(np.where(inside[:, None], ratio, 1.0))
        terms = [
            _log_density_of_difference(log_ratio[:, j], each) - log_ratio[:, j]
            for j, each in enumerate(self.theta.parameters)
        ]
        return np.where(inside, np.sum(terms, axis=0), -np.inf)


def _log_density_of_difference(delta: FloatArray, of_visit: ParameterPrior) -> FloatArray:
    """Return log pi(delta) of log ratios (n,) within the bounds; shape (n,)."""
    mean, sd = np.log(of_visit.centre), of_visit.log_sd
    low, high = np.log([of_visit.low, of_visit.high])
    about = mean + 0.5 * delta
    least, most = np.maximum(low, low + delta), np.minimum(high, high + delta)
    both = log_normal_mass((least - about) * ROOT_TWO / sd, (most - about) * ROOT_TWO / sd)
    each = log_normal_mass(np.array((low - mean) / sd), np.array((high - mean) / sd))
    width = ROOT_TWO * sd
    return np.asarray(-0.5 * (delta / width) ** 2 - np.log(width) - LOG_ROOT_TWO_PI + both - 2.0 * each)


def log_density(values: FloatArray, prior: BoxPrior | RatioPrior) -> FloatArray:
    """Return the log density, per unit of each value, of values (n, 3) under either prior; shape (n,)."""
    if isinstance(prior, RatioPrior):
        return prior.log_density(values)
    return log_density_of_box(values, prior)


def log_normal_mass(low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the log probability of a standard normal variable between limits, however far off they lie."""
    flipped = low > 0.0  # the upper tail is the lower one of minus the variable
    below, above = np.where(flipped, -high, low), np.where(flipped, -low, high)
    log_above = log_ndtr(above)
    with np.errstate(divide="ignore"):  # at the ends of the ratio's support both limits are one
        return np.asarray(log_above + np.log1p(-np.exp(log_ndtr(below) - log_above)))


@dataclass(frozen=True)
class RecycledDraws:
    """Draws theta (n, 3) of one subject's posterior, and their log weights (n,); weights sum to one."""

    theta: FloatArray
    log_weight: FloatArray


@dataclass(frozen=True)
class PriorAlone:
    """A prior, for what asks a model of a likelihood for its settings."""

    prior: BoxPrior


@dataclass(frozen=True)
class CohortModel:
    """The model of a cohort of d subjects: the hyperprior, and recycled draws of each.

    Shapes are (d, c) of the design, (d,) of the probability to be none of the population. ``theta_prior`` is
    pi, under which the draws were made; of ratios of theta where these are the draws.
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
                yield np.column_stack([quadratic, linear, scalar, np.ones(len(rows))]) @ features

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

    ``log_rows`` (m, 2 + c, 3) are logarithms of hyperparameters in rows; the design is (d, c).
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


@dataclass(frozen=True)
class Shrinkage:
    """What the population makes of the d subjects, in each of m hyperdraws or averaged over them.

    Averaged are the weights of recycled draws, (n,) each, their effective number (d,), and the probability of
    an outlier (d,). ``rows`` (m, d) are joint draws of all: one recycled draw of each a hyperdraw.
    """

    weights: tuple[FloatArray, ...]
    rows: NDArray[np.int_]
    effective: FloatArray
    outlier: FloatArray
    log_likelihood: FloatArray


def shrink(model: CohortModel, eta: FloatArray, rng: np.random.Generator) -> Shrinkage:
    """Reweight the recycled draws of every subject by draws eta (m, k) of the population's posterior.

    Given eta, a draw weighs w_n ((1 - p) p(theta_n | eta) / pi(theta_n) + p), over the sum of all, which is
    the subject's likelihood; what is averaged over eta are these normalised weights.
    """
    levels = rng.random((len(eta), len(model.recycled)))
    blocks = [
        [
            _of_subject(model, number, ratio, levels[block * BLOCK :, number])
            for number, ratio in enumerate(ratios)
        ]
        for block, ratios in enumerate(model.log_ratios(eta))
    ]
    by_subject = [zip(*parts, strict=True) for parts in zip(*blocks, strict=True)]
    joined = [(np.sum(weight, axis=0), *map(np.concatenate, rest)) for weight, *rest in by_subject]
    weights, rows, effective, outlier, log_likelihood = zip(*joined, strict=True)
    return Shrinkage(
        weights=tuple(weight / len(eta) for weight in weights),
        rows=np.stack(rows, axis=1),
        effective=np.array([one.mean() for one in effective]),
        outlier=np.array([one.mean() for one in outlier]),
        log_likelihood=np.stack(log_likelihood, axis=1),
    )


def _of_subject(
    model: CohortModel, number: int, log_ratio: FloatArray, levels: FloatArray
) -> tuple[NDArray[Any], ...]:
    """Return a subject under a block of hyperdraws: the sum of its weights over these, and the rest of each.

    It is one drawn row, the effective number of draws, the probability of an outlier, the log likelihood.
    """
    p = float(model.outlier[number])
    own = np.exp(model.recycled[number].log_weight)
    largest = np.maximum(log_ratio.max(axis=1), 0.0)[:, None]
    weight = (1.0 - p) * np.exp(log_ratio - largest) + p * own * np.exp(-largest)
    total = weight.sum(axis=1)
    weight /= total[:, None]
    edges = np.cumsum(weight, axis=1)
    drawn = (edges < levels[: len(weight), None] * edges[:, -1:]).sum(axis=1)
    return (
        weight.sum(axis=0),
        drawn,
        1.0 / (weight**2).sum(axis=1),
        p * np.exp(-largest[:, 0]) / total,
        largest[:, 0] + np.log(total),
    )


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
