"""Student distributions fitted to weighted draws: a proposal with tails for its weights.

Of few draws one distribution is all that can be estimated. Of more, a mixture follows a posterior that is
bent or has two modes (Cappe, Douc, Guillin, Marin and Robert 2008, Stat Comput 18:447).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from scipy.special import logsumexp

from swesbi.base.arrays import FloatArray
from swesbi.draws import normalised

DEGREES_OF_FREEDOM: Final = 8  # heavier tails than a posterior's, so that weights stay bounded
WIDENING: Final = 1.2  # of the covariance
RIDGE: Final = 1e-4  # least variance of a proposal, in eta
DRAWS_A_PARAMETER: Final = 2.5  # effective ones behind a proposal; a posterior with fewer is flattened
DRAWS_A_PART: Final = 100  # effective ones behind each part of a mixture
MOST_PARTS: Final = 4
STEPS: Final = 8  # of expectation maximisation; further ones gain nothing
SHRINKAGE: Final = 1.0  # weight of the common covariance in that of a part, in draws a parameter
NEGLIGIBLE: Final = 1e-3  # of the largest weight; draws below it do not move a fit


@dataclass(frozen=True)
class StudentProposal:
    """A multivariate Student distribution; mean (d,) and scale matrix (d, d)."""

    mean: FloatArray
    scale: FloatArray
    degrees_of_freedom: int = DEGREES_OF_FREEDOM

    def draw(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return eta of shape (count, d)."""
        drawn = self._distribution.rvs(size=count, random_state=rng)
        return np.reshape(drawn, (count, len(self.mean)))

    def log_density(self, eta: FloatArray) -> FloatArray:
        """Return the log density at eta (n, d); shape (n,)."""
        # SciPy gives a number for one point
        return np.reshape(self._distribution.logpdf(eta), (len(eta),))

    @cached_property
    def _distribution(self) -> Any:  # noqa: ANN401
        from scipy.stats import multivariate_t

        return multivariate_t(self.mean, self.scale, df=self.degrees_of_freedom)


@dataclass(frozen=True)
class StudentMixture:
    """A mixture of k Student distributions; shares (k,) sum to one."""

    share: FloatArray
    parts: tuple[StudentProposal, ...]

    def draw(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return eta of shape (count, d)."""
        part_of = np.searchsorted(np.cumsum(self.share[:-1]), rng.random(count), side="right")
        eta = np.empty((count, len(self.parts[0].mean)))
        for number, part in enumerate(self.parts):
            eta[part_of == number] = part.draw(int(np.count_nonzero(part_of == number)), rng)
        return eta

    def log_density(self, eta: FloatArray) -> FloatArray:
        """Return the log density at eta (n, d); shape (n,)."""
        return np.asarray(logsumexp(self.log_parts(eta), axis=1))

    def log_parts(self, eta: FloatArray) -> FloatArray:
        """Return the log density of each part, with its share, at eta (n, d); shape (n, k)."""
        return np.stack([part.log_density(eta) for part in self.parts], axis=1) + np.log(self.share)


def fitted_proposal(eta: FloatArray, log_weight: FloatArray) -> StudentMixture:
    """Return a wide proposal fitted to weighted draws (n, d).

    Where few draws carry the weight, it is flattened to a power below one until enough do. The parts of the
    mixture begin as slices of the draws along the coordinate in which they vary most, and are fitted by
    expectation maximisation. The covariance of a part with few draws is shrunk towards that of all.
    LinAlgError: a covariance is singular in double precision.
    """
    weight = normalised(_tempering(log_weight, DRAWS_A_PARAMETER * eta.shape[1]) * log_weight)
    parts = int(np.clip(1.0 / (weight**2).sum() / DRAWS_A_PART, 1, MOST_PARTS))
    kept = weight > NEGLIGIBLE * weight.max()
    eta, weight = eta[kept], weight[kept] / weight[kept].sum()
    common = _covariance(eta, weight)
    belongs = _slices(eta, weight, common, parts)
    mixture = _mixture(eta, weight, belongs, common)
    for _ in range(STEPS if parts > 1 else 0):
        log_parts = mixture.log_parts(eta)
        belongs = np.exp(log_parts - logsumexp(log_parts, axis=1, keepdims=True))
        mixture = _mixture(eta, weight, belongs, common)
    return mixture


def _covariance(eta: FloatArray, weight: FloatArray) -> FloatArray:
    centred = eta - weight @ eta
    return centred.T @ (centred * weight[:, None])


def _slices(eta: FloatArray, weight: FloatArray, covariance: FloatArray, parts: int) -> FloatArray:
    """Return to which part draws (n, d) belong at first: slices of equal weight; shape (n, parts)."""
    order = np.argsort(eta[:, np.argmax(np.diag(covariance))], kind="stable")
    middle = np.empty(len(eta))
    middle[order] = np.cumsum(weight[order]) - 0.5 * weight[order]
    return np.eye(parts)[np.minimum((parts * middle).astype(np.int64), parts - 1)]


def _mixture(eta: FloatArray, weight: FloatArray, belongs: FloatArray, common: FloatArray) -> StudentMixture:
    """Return the mixture of parts to which weighted draws (n, d) belong by shares (n, k)."""
    of_parts = (belongs * weight[:, None]).T
    share, prior_draws = of_parts.sum(axis=1), SHRINKAGE * eta.shape[1]
    fitted = []
    for own, total in zip(of_parts, share, strict=True):
        effective = total**2 / (own**2).sum()
        covariance = _covariance(eta, own / total)
        shrunk = (effective * covariance + prior_draws * common) / (effective + prior_draws)
        fitted.append(StudentProposal(own @ eta / total, WIDENING * shrunk + RIDGE * np.eye(eta.shape[1])))
    return StudentMixture(share / share.sum(), tuple(fitted))


def _tempering(log_weight: FloatArray, least_effective: float) -> float:
    """Return the power of weights (n,), at most one, at which so many draws are effective."""
    from scipy.optimize import brentq

    known = log_weight[np.isfinite(log_weight)]
    relative = known - known.max()
    wanted = min(least_effective, 0.5 * len(known))

    def lacking(power: float) -> float:
        weight = np.exp(power * relative)
        return wanted - float(weight.sum() ** 2 / (weight**2).sum())

    return 1.0 if lacking(1.0) <= 0.0 else float(brentq(lacking, 0.0, 1.0, xtol=1e-6))
