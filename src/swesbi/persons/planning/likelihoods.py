"""Normal likelihoods of a bank's persons, and what studies of these persons say of an effect.

A posterior of three log parameters of mean a and covariance V, under a prior near normal, N(m, D), is that of
a normal likelihood of precision V^-1 - D^-1. A population of means mu and spreads tau then has the evidence
N(y; mu, S + diag(tau^2)) of a person whose likelihood lies about y with the covariance S, or the person is
none of theirs, with the probability that the posterior of a cohort takes. The logarithm of that mixture is
taken to second order about the middle of the bank, so that a study, whose persons are independent given mu
and tau, is a sum of constants, slopes and curvatures over its persons, and normal in mu at each point of a
grid of tau. Of two groups each has a mu of its own, and what ties them is the prior of their ratio.
Truncation at the prior's bounds, which persons hardly reach, is left out.

By chance a bank's persons respond a little more or less than the population, and their recordings err a
little to one side. What all persons have in common of that does not average out over the studies drawn from
them: where a study of n persons just has its power, chance variation of the bank of N moves the middle of its
test by sqrt(n / N) standard errors. Two things are known of it and are taken off, as control variates are:

- each person's true response r, whose mean in the population is the logarithm of the effect;
- of pairs the person's answer x without the effect, whose mean is 0 since visits nothing lies between may be
  exchanged. Both arms are recorded with the same errors (``planning.simulation``), so that a bank errs in
  both alike; groups are both drawn from the bank, where such errors cancel by themselves.

With y the answer with the effect, likelihoods with the effect are moved along the log parameter by

    c = (log effect - mean r) - b mean x,

b being the slope of y - r on x by least squares, within [0, 1]. Means are weighted as persons count in a
population of a usual spread.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from scipy.special import ndtr

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.persons.cohort.model import thread_pools
from swesbi.persons.planning.effect import Effect, log_factor
from swesbi.persons.planning.simulation import ARMS, EFFECT, NONE, Bank
from swesbi.persons.settings import (
    PAIRED,
    ChangeGroupsSettings,
    HierarchySettings,
    HyperpriorSettings,
    RatioHyperpriorSettings,
)
from swesbi.prior import PriorSettings, even_quantiles

LEAST_CONTRACTION: Final = 0.2
"""Of a posterior against the prior: one as wide as the prior has no likelihood whose middle could be told."""
SPREADS: Final = 6
"""Points of the grid along the spread of each parameter."""
UPPER: Final = np.triu_indices(3)
AT_ONCE: Final = 100
"""Studies whose weights are held in memory together."""


@dataclass(frozen=True)
class StudyAnalysis:
    """By what a study is analysed: the prior of theta, the posterior of a cohort, the change in groups."""

    theta: PriorSettings
    cohort: HierarchySettings
    changes: ChangeGroupsSettings


@dataclass(frozen=True)
class Sums:
    """Constant (t, s), slope (t, s, 3) and curvature (t, s, 3, 3) of the log evidence of s studies."""

    constant: FloatArray
    slope: FloatArray
    curvature: FloatArray


@dataclass(frozen=True)
class Expansion:
    """Log evidence of N persons to second order about a mean (3,), at t spreads.

    Terms (t, 10, N) are constant, slopes and upper triangle of the curvature.
    """

    about: FloatArray
    terms: FloatArray

    def summed(self, counts: FloatArray) -> Sums:
        """Return the evidence of studies that have each person so often, (N, s)."""
        sums = np.moveaxis(self.terms @ counts, 1, -1)
        curvature = np.empty((*sums.shape[:2], 3, 3))
        curvature[..., UPPER[0], UPPER[1]] = curvature[..., UPPER[1], UPPER[0]] = sums[..., 4:]
        return Sums(sums[..., 0], sums[..., 1:4], curvature)


@dataclass(frozen=True)
class Likelihoods:
    """Likelihoods of the log parameters of the N persons of a bank, without the effect and with it.

    They are of the ratio of two visits where ``paired``, else of theta. Shapes are (2, N, 3) and (2, N, 3,
    3). ``response`` (N,) is the log of the true response less the effect; ``prior`` has mean and variance of
    the prior of the draws, (3,) each.
    """

    effect: Effect
    paired: bool
    middle: FloatArray
    covariance: FloatArray
    response: FloatArray
    prior: tuple[FloatArray, FloatArray]
    by: StudyAnalysis

    @property
    def hyperprior(self) -> HyperpriorSettings | RatioHyperpriorSettings:
        """Of the population."""
        return self.by.changes.hyperprior if self.paired else self.by.cohort.hyperprior

    @cached_property
    def spread(self) -> tuple[FloatArray, FloatArray]:
        """Grid of tau, (t, 3), the middles of cells even in its logarithm, and its log prior (t,)."""
        prior = self.hyperprior.spread
        edges = np.linspace(np.log(prior.low), np.log(prior.high), SPREADS + 1)
        middle = 0.5 * (edges[1:] + edges[:-1])
        grid = np.stack(np.meshgrid(middle, middle, middle, indexing="ij"), axis=-1).reshape(-1, 3)
        distance = (grid - np.log(prior.centre)) / prior.log_sd
        return np.exp(grid), -0.5 * (distance**2).sum(axis=1)

    @cached_property
    def by_arm(self) -> dict[str, Expansion]:
        """The persons of each arm as a population has them.

        Ratios without an effect come twice: as they are, and with both visits exchanged. So a bank without an
        effect has by chance none either.
        """
        both = list(zip(self.middle, self.covariance, strict=True))
        if self.paired:
            middle, covariance = both[0]
            both[0] = (np.concatenate([middle, -middle]), np.concatenate([covariance, covariance]))
        return {arm: self._expanded(*each) for arm, each in zip(ARMS, both, strict=True)}

    def _expanded(self, middle: FloatArray, covariance: FloatArray) -> Expansion:
        """Return the log evidence of N persons to second order about their middle."""
        about, (mean, variance) = np.median(middle, axis=0), self.prior
        within = covariance + np.eye(3) * self.spread[0][:, None, None] ** 2
        log_ratio, slope, curvature = _log_normal(middle - about, within)
        log_ratio = log_ratio - _log_normal(middle - mean, covariance + np.diag(variance))[0]
        outlier = self.by.cohort.outliers.not_contradicted
        with np.errstate(divide="ignore"):
            log_member = np.log1p(-outlier) + log_ratio
            constant = np.logaddexp(log_member, np.log(outlier))
        share = np.exp(log_member - constant)[..., None]
        upper = curvature[..., UPPER[0], UPPER[1]]
        terms = np.concatenate([constant[..., None], share * slope, share * upper], axis=-1)
        return Expansion(about, np.ascontiguousarray(terms.swapaxes(1, 2)))

    def probability(
        self, counts: FloatArray, control: FloatArray, arm: str, displacement: float = 0.0
    ) -> FloatArray:
        """Analyse s studies: return the probability of an effect in its direction; shape (s,).

        Counts (N, s) tell how often each person is in each study; those of the control group are not read of
        pairs. Likelihoods that lie higher by the displacement c say of a mu higher by c what they said
        before.
        """
        changing, own, found = self.by_arm[arm], self.by_arm[NONE], []
        about = changing.about + displacement * np.eye(3)[self.effect.number]
        for start in range(0, counts.shape[1], AT_ONCE):
            of = slice(start, start + AT_ONCE)
            with thread_pools().limit(limits=1):  # sums split over threads differ in the last bit
                sums = changing.summed(counts[:, of])
                if self.paired:
                    found.append(self._judged(self._of_pairs(sums, about), about))
                else:
                    apart = about - own.about
                    both = self._of_groups(sums, own.summed(control[:, of]), apart, own.about)
                    found.append(self._judged(both, apart))
        return np.concatenate(found)

    def _of_pairs(self, told: Sums, about: FloatArray) -> Sums:
        """Return what studies say of mu less ``about``, the prior of mu included."""
        median = self.by.changes.hyperprior.median
        precision = np.eye(3) / median.log_sd**2
        slope = told.slope + precision @ (np.log(median.centre) - about)
        return Sums(told.constant, slope, told.curvature + precision)

    def _of_groups(self, treated: Sums, control: Sums, apart: FloatArray, about: FloatArray) -> Sums:
        """Return what studies say of the ratio of both groups less ``apart``, over all mu of the control."""
        level = np.array([(np.log(each.centre), each.log_sd**-2.0) for each in self.by.theta.parameters])
        factor = self.by.cohort.hyperprior.group_factor
        own = control.curvature + np.diag(level[:, 1])
        own_slope = control.slope + level[:, 1] * (level[:, 0] - about)
        # with x of the control group and f of the ratio, those treated lie at x + f
        whole = np.linalg.inv(own + treated.curvature)
        both = own_slope + treated.slope
        carried = treated.curvature @ whole
        slope = treated.slope - (carried @ both[..., None])[..., 0] - apart / factor.log_sd**2
        curvature = treated.curvature - carried @ treated.curvature + np.eye(3) / factor.log_sd**2
        constant = treated.constant + control.constant + 0.5 * np.log(np.linalg.det(whole))
        constant += 0.5 * np.einsum("tsi,tsij,tsj->ts", both, whole, both)
        return Sums(constant, slope, curvature)

    def _judged(self, told: Sums, about: FloatArray) -> FloatArray:
        """Return the probability of an effect from normal posteriors about ``about`` at the grid of tau."""
        covariance, j = np.linalg.inv(told.curvature), self.effect.number
        middle = (covariance @ told.slope[..., None])[..., 0]
        log_weight = told.constant + 0.5 * np.log(np.linalg.det(covariance)) + self.spread[1][:, None]
        log_weight += 0.5 * (told.slope * middle).sum(axis=-1)
        weight = np.exp(log_weight - log_weight.max(axis=0))
        rises = ndtr((middle[..., j] + about[j]) / np.sqrt(covariance[..., j, j]))
        side = rises if self.effect.change > 0.0 else 1.0 - rises
        return np.asarray((weight * side).sum(axis=0) / weight.sum(axis=0))

    def displacement(self, persons: IntArray) -> float:
        """Return c of the bank that some persons make, by their places; one may be there several times."""
        j = self.effect.number
        usual = self.covariance[:, :, j, j].mean(axis=0) + self.hyperprior.spread.centre**2
        weight = 1.0 / usual[persons]
        weight /= weight.sum()
        moved = -float(weight @ self.response[persons])
        if not self.paired:
            return moved
        without, effect = (self.middle[ARMS.index(arm), :, j] for arm in (NONE, EFFECT))
        surplus = (effect - self.response - log_factor(self.effect))[persons]
        return moved - _slope(without[persons], surplus, weight) * float(weight @ without[persons])


def likelihoods_of(bank: Bank, design: str, effect: Effect, by: StudyAnalysis) -> Likelihoods:
    """Return the likelihoods of the persons of a bank, of a design ``paired`` or ``groups``."""
    log_theta, paired = np.log(even_quantiles(by.theta)), design == PAIRED
    mean, variance = log_theta.mean(axis=0), log_theta.var(axis=0)
    if paired:
        mean, variance = np.zeros(3), 2.0 * variance
    width = np.sqrt(variance)
    spread, axes = np.linalg.eigh(bank.covariance / (width[:, None] * width))
    told = np.clip(1.0 - spread, LEAST_CONTRACTION, 1.0)
    turned = np.einsum("naji,naj->nai", axes, (bank.mean - mean) / width) / told
    middle = mean + width * np.einsum("naij,naj->nai", axes, turned)
    covariance = (axes * (spread / told)[..., None, :]) @ axes.swapaxes(-1, -2) * (width[:, None] * width)
    truth = np.log(bank.truth[:, :, effect.number]).T
    response = truth[ARMS.index(EFFECT)] - truth[ARMS.index(NONE)] - log_factor(effect)
    return Likelihoods(
        effect, paired, middle.swapaxes(0, 1), covariance.swapaxes(0, 1), response, (mean, variance), by
    )


def _log_normal(distance: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return log density of normals at distances (N, 3) above their mean, slope along it, curvature.

    Covariances are (..., N, 3, 3); shapes (..., N), (..., N, 3) and (..., N, 3, 3).
    """
    precision = np.asarray(np.linalg.inv(covariance), np.float64)
    slope = (precision @ distance[..., None])[..., 0]
    log_density = 0.5 * np.log(np.linalg.det(precision)) - 0.5 * (slope * distance).sum(axis=-1)
    return np.asarray(log_density), slope, precision


def _slope(x: FloatArray, y: FloatArray, weight: FloatArray) -> float:
    """Return the slope of y on x, (N,) each, within [0, 1]; 0 where x does not vary."""
    about = x - weight @ x
    variance = float(weight @ about**2)
    return float(np.clip(weight @ (about * y) / variance, 0.0, 1.0)) if variance > 0.0 else 0.0
