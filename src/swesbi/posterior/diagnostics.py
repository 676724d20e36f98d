"""Whether draws stand for a posterior: Pareto-smoothed weights with k-hat, R-hat, effective draws of chains.

They follow the published algorithms, so that the check of an answer's sampling is the same under every
version of every library. Vehtari et al. (2024), "Pareto smoothed importance sampling", J Mach Learn Res
25:72. Vehtari et al. (2021), "Rank-normalization, folding, and localization: an improved R-hat", Bayesian
Anal 16:667.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy import fft
from scipy.special import ndtri

from swesbi.base.arrays import FloatArray

LEAST_TAIL: Final = 5
"""Weights of which a Pareto tail can be fitted."""
PRIOR_SHAPE: Final = 0.5
PRIOR_WEIGHT: Final = 10
"""The weak prior of k-hat: its value, and how many weights it counts as (Vehtari et al. 2024)."""
TINY: Final = 2.0**-1022
EPSILON: Final = 2.0**-52


def smooth(log_ratio: FloatArray) -> tuple[FloatArray, float]:
    """Smooth the largest importance ratios by a generalised Pareto distribution (Vehtari et al. 2024).

    Log ratios (n,) are -inf where one is zero. The log weights sum to one. The Pareto shape k-hat is infinite
    where the tail is too short to tell, and 0 where all ratios are equal, the best weights that there are.
    """
    draws = len(log_ratio)
    if log_ratio.min() == log_ratio.max():
        return np.full(draws, -np.log(draws)), 0.0
    with np.errstate(all="ignore"):  # the fit to a tail of many thousand nats overflows; k-hat is large then
        log_weight = log_ratio - log_ratio.max()
        tail_draws = int(np.ceil(min(draws / 5.0, 3.0 * np.sqrt(draws))))
        cutoff = max(np.sort(log_weight)[max(draws - tail_draws - 1, 0)], np.log(TINY))
        tail = np.flatnonzero(log_weight > cutoff)
        if len(tail) < LEAST_TAIL:
            return normalised(log_weight), np.inf
        tail = tail[np.argsort(log_weight[tail], kind="stable")]
        shape, scale = fitted_pareto(np.exp(log_weight[tail]) - np.exp(cutoff))
        if np.isfinite(shape):
            level = np.arange(0.5, len(tail)) / len(tail)
            smoothed = np.log(pareto_quantile(level, shape, scale) + np.exp(cutoff))
            log_weight[tail] = np.minimum(smoothed, 0.0)  # no smoothed ratio exceeds the largest one
        return normalised(log_weight), float(shape)


def normalised(log_weight: FloatArray) -> FloatArray:
    """Return the logarithms of weights (n,) that sum to one."""
    largest = log_weight.max()
    return np.asarray(log_weight - (np.log(np.exp(log_weight - largest).sum()) + largest))


def fitted_pareto(excess: FloatArray) -> tuple[float, float]:
    """Return shape and scale of a generalised Pareto distribution, fitted to sorted excesses (n,).

    The estimator of Zhang and Stephens (2009, Technometrics 51:316), with the weak prior of the shape of
    Vehtari et al. (2024).
    """
    number = len(excess)
    points = 30 + int(np.sqrt(number))
    quarter = excess[int(number / 4 + 0.5) - 1]
    place = np.arange(1, points + 1) - 0.5
    rate = (1.0 - np.sqrt(points / place)) / (3.0 * quarter) + 1.0 / excess[-1]
    shape = np.log1p(-rate[:, None] * excess).mean(axis=1)
    log_profile = number * (np.log(-rate / shape) - shape - 1.0)
    weight = 1.0 / np.exp(log_profile - log_profile[:, None]).sum(axis=1)
    counts = weight >= 10.0 * EPSILON
    rate, weight = rate[counts], weight[counts]
    mean_rate = float(np.sum(rate * (weight / weight.sum())))
    mean_shape = float(np.log1p(-mean_rate * excess).mean())
    with_prior = (number * mean_shape + PRIOR_WEIGHT * PRIOR_SHAPE) / (number + PRIOR_WEIGHT)
    return with_prior, -mean_shape / mean_rate


def pareto_quantile(level: FloatArray, shape: float, scale: float) -> FloatArray:
    """Return quantiles of the generalised Pareto distribution at levels in (0, 1); NaN without a scale."""
    if not scale > 0.0:
        return np.full(len(level), np.nan)
    exponential = -np.log1p(-level)
    if abs(shape) < EPSILON:
        return np.asarray(scale * exponential)
    return np.asarray(scale * (np.expm1(shape * exponential) / shape))


def split_r_hat(phi: FloatArray) -> FloatArray:
    """Return the rank-normalised split R-hat of draws (chain, n, d), of bulk and tails; shape (d,).

    It is the larger one of two (Vehtari et al. 2021, Sec. 4): of the draws, and of their distances from the
    median.
    """
    found = []
    for column in np.moveaxis(phi, -1, 0):
        halves = split(column)
        folded = np.abs(halves - np.median(halves))
        found.append(max(r_hat(normal_scores(halves)), r_hat(normal_scores(folded))))
    return np.array(found)


def effective_number(chains: FloatArray) -> float:
    """Return how many independent draws have a mean as exact as that of chains (chain, n), each halved.

    Autocorrelations count up to where the sum of two neighbours turns negative, and never rise (Geyer 1992;
    Vehtari et al. 2021, Sec. 3.2).
    """
    halves = split(chains)
    number, draws = halves.shape
    if np.ptp(halves) < 1e-15:  # all draws are one value, whose mean is exact
        return float(halves.size)
    covariance = autocovariance(halves).mean(axis=0)
    within = covariance[0] * draws / (draws - 1.0)
    total = covariance[0] + halves.mean(axis=1).var(ddof=1)
    correlation = 1.0 - (within - covariance) / total
    correlation[0] = 1.0
    last = max((draws - 3) // 2, 0)  # of lags behind it hardly a product is averaged
    pairs = correlation[: 2 * last + 2].reshape(-1, 2).sum(axis=1)
    if not (pairs > 0.0).all():
        last = int(np.argmin(pairs > 0.0))
    monotone = np.minimum.accumulate(pairs[:last])
    time = -1.0 + 2.0 * monotone.sum() + max(correlation[2 * last], 0.0)
    return float(halves.size / max(time, 1.0 / np.log10(halves.size)))


def split(chains: FloatArray) -> FloatArray:
    """Return the first and the last halves of chains (chain, n), one below the other; (2 chain, n // 2)."""
    half = chains.shape[1] // 2
    return np.concatenate([chains[:, :half], chains[:, chains.shape[1] - half :]])


def normal_scores(values: FloatArray) -> FloatArray:
    """Return the normal quantiles of the ranks of all values (Blom 1958), in their shape."""
    from scipy.stats import rankdata  # a quarter of a second, of which importance sampling needs nothing

    ranks = rankdata(values, method="average").reshape(values.shape)
    return np.asarray(ndtri((ranks - 3.0 / 8.0) / (values.size + 1.0 / 4.0)))


def r_hat(chains: FloatArray) -> float:
    """Return the root of the variance of all draws (chain, n) over the variance within chains."""
    draws = chains.shape[1]
    between, within = draws * chains.mean(axis=1).var(ddof=1), chains.var(axis=1, ddof=1).mean()
    return float(np.sqrt((between / within + draws - 1.0) / draws))


def autocovariance(chains: FloatArray) -> FloatArray:
    """Return the autocovariances of chains (chain, n) at lags 0 to n - 1, by Fourier transform."""
    draws = chains.shape[1]
    length = fft.next_fast_len(2 * draws, real=True)
    spectrum = fft.rfft(chains - chains.mean(axis=1, keepdims=True), length, axis=1)
    return np.asarray(fft.irfft(spectrum * spectrum.conj(), length, axis=1)[:, :draws] / draws)
