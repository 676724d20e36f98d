"""Parameters of a measurement integrated out of a likelihood by draws about their mode.

What a simulation gives, the point, is dear; what is measured of it then follows from a few more parameters
at once. Given the point, data are nearly linear in the normal scores s of these, so their posterior is nearly
normal. Gauss-Newton steps find its mode and its covariance, and draws from a Student distribution q about it
the integral

    p(data | point) = E_q[p(data | point, s) N(s; 0, I) / q(s)].

The mean over a few draws is unbiased, and weights by an unbiased estimate lead to the exact posterior
(Beaumont 2003, Genetics 164:1139; Andrieu and Roberts 2009, Ann Stat 37:697; Tran, Scharth, Pitt and Kohn
2013, arXiv:1309.3339). The draws depend on the point's own numbers alone, so that it always has the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincinv, gammaln, logsumexp, ndtri

from swesbi.base.arrays import FloatArray
from swesbi.measurement.shared_error import CellErrors, Errors
from swesbi.networks.affine_maf import log_normal
from swesbi.posterior.importance import EvaluatedPoints

DRAWS: Final = 4  # an integral; each has three quarters of an exact draw's worth
SEARCH: Final = 3  # times that errors are taken at the mode so far
STEPS: Final = 2  # Gauss-Newton steps with these; a seventh moves the mode by a hundredth of its width
LONGEST: Final = 2.0  # of a step, in scores
FARTHEST: Final = 3.5  # of the mode, in scores
DEGREES_OF_FREEDOM: Final = 6
WIDER: Final = 1.3  # of the covariance, so that q has heavier tails than the posterior
INTEGRAL, CHOICE = 0, 1
"""Streams of random numbers."""
GOLDEN: Final = np.uint64(0x9E3779B97F4A7C15)
Simulated = TypeVar("Simulated")
"""What simulations of n points give."""


@dataclass(frozen=True)
class Conditional:
    """The Student distributions about the modes of the scores, given n points.

    Modes are (n, o), Cholesky factors of the scale matrices (n, o, o).
    """

    mode: FloatArray
    root: FloatArray

    def draw(self, uniform: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return scores (n, o) and their log density (n,) from uniform numbers (n, o + 1)."""
        nu, width = DEGREES_OF_FREEDOM, self.mode.shape[1]
        stretch = np.sqrt(2.0 * gammaincinv(0.5 * nu, uniform[:, 0]) / nu)
        z = ndtri(uniform[:, 1:]) / stretch[:, None]
        log_det = np.log(np.diagonal(self.root, axis1=1, axis2=2)).sum(axis=1)
        norm = gammaln(0.5 * (nu + width)) - gammaln(0.5 * nu) - 0.5 * width * np.log(nu * np.pi)
        log_density = norm - log_det - 0.5 * (nu + width) * np.log1p((z**2).sum(axis=1) / nu)
        return self.mode + np.einsum("nij,nj->ni", self.root, z), log_density


class Marginal(Generic[Simulated]):
    """A likelihood with some of its parameters integrated out; a model says what it simulates and predicts.

    Scores of the o parameters that are integrated out have the shape (n, o).
    """

    @property
    def width(self) -> int:
        """Number o of parameters that are integrated out."""
        raise NotImplementedError

    @property
    def counts_beside(self) -> bool:
        """Whether what is known beside the recording is part of the likelihood."""
        return True

    def simulated(self, points: FloatArray) -> tuple[Simulated, FloatArray]:
        """Return simulations of points (n, k), and the log density of what is known beside the data, (n,)."""
        raise NotImplementedError

    def completed(self, points: FloatArray, scores: FloatArray) -> FloatArray:
        """Return all parameters, phi (n, d)."""
        raise NotImplementedError

    def log_likelihood_of(self, points: FloatArray, simulated: Simulated, scores: FloatArray) -> FloatArray:
        """Return log p(data | point, scores), -inf where the simulation failed; shape (n,)."""
        raise NotImplementedError

    def linear(self, simulated: Simulated, scores: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return data less their predictions (n, p), and the slopes of these along the scores (n, p, o)."""
        raise NotImplementedError

    def errors(self, points: FloatArray, simulated: Simulated, scores: FloatArray) -> Errors | CellErrors:
        """Return the errors of the data at these scores, roughly: q need not be the posterior."""
        raise NotImplementedError

    def log_likelihood(self, points: FloatArray) -> FloatArray:
        """Return an unbiased estimate of p(data | point), as its log, of points (n, k); shape (n,).

        It depends on the point's own numbers alone. -inf where the simulation failed.
        """
        _, log_ratio, _, beside = self._draws(points)
        return _log_mean(log_ratio) + (beside if self.counts_beside else 0.0)

    def evaluated(self, points: FloatArray) -> EvaluatedPoints:
        """Return points (n, k) with that likelihood, and with phi (n, d).

        Of the draws behind the likelihood of each point one is taken by its weight. So phi has the posterior
        of all parameters where the points are weighted by that likelihood.
        """
        scores, log_ratio, log_likelihood, beside = self._draws(points)
        gumbel = -np.log(-np.log(uniform(row_numbers(points, CHOICE), 0, DRAWS)))
        taken, rows = np.argmax(log_ratio + gumbel.T, axis=0), np.arange(len(points))
        phi = self.completed(points, scores[taken, rows])
        found = EvaluatedPoints(_log_mean(log_ratio), phi, log_likelihood[taken, rows], beside)
        return found.informed() if self.counts_beside else found

    def conditional(self, points: FloatArray, simulated: Simulated) -> Conditional:
        """Return the Student distributions of the scores about their modes, given n points."""
        mode = np.zeros((len(points), self.width))
        for _ in range(SEARCH):
            errors = self.errors(points, simulated, mode)
            for _ in range(STEPS):
                distance, jacobian = self.linear(simulated, mode)
                weighed = errors.solve(np.dstack([jacobian, distance]))
                precision = np.einsum("npi,npj->nij", jacobian, weighed[:, :, :-1]) + np.eye(self.width)
                gradient = np.einsum("npi,np->ni", jacobian, weighed[:, :, -1]) - mode
                step = np.linalg.solve(precision, gradient[:, :, None])[:, :, 0]
                length = np.maximum(np.linalg.norm(step, axis=1, keepdims=True), LONGEST)
                mode = np.clip(mode + step * (LONGEST / length), -FARTHEST, FARTHEST)
        return Conditional(mode, np.asarray(np.linalg.cholesky(WIDER * np.linalg.inv(precision)), np.float64))

    def _draws(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return draws of the scores given n points, (m, n, o), their log ratios and log likelihoods.

        Behind them stands the log density of what is known beside the recording, (n,).
        """
        (simulated, beside), numbers = self.simulated(points), row_numbers(points, INTEGRAL)
        about = self.conditional(points, simulated)
        drawn = [about.draw(uniform(numbers, draw, self.width + 1)) for draw in range(DRAWS)]
        log_likelihood = np.stack([self.log_likelihood_of(points, simulated, scores) for scores, _ in drawn])
        log_density = np.stack([log_normal(scores) - log_q for scores, log_q in drawn])
        draws = np.stack([scores for scores, _ in drawn])
        return draws, log_likelihood + log_density, log_likelihood, beside


def _log_mean(log_ratio: FloatArray) -> FloatArray:
    """Return the log of the mean ratio over draws, (m, n); shape (n,)."""
    return np.asarray(logsumexp(log_ratio, axis=0) - np.log(len(log_ratio)))


def row_numbers(values: FloatArray, stream: int) -> NDArray[np.uint64]:
    """Return a number of each row (n, k) that follows from its bits and a stream alone; shape (n,)."""
    number = np.full(len(values), stream, np.uint64)
    for column in np.ascontiguousarray(values.T).view(np.uint64):
        number = mixed(number ^ column)
    return number


def uniform(numbers: NDArray[np.uint64], draw: int, width: int) -> FloatArray:
    """Return uniform numbers in (0, 1) of this draw of each row; shape (n, width)."""
    places = np.arange(draw * width + 1, (draw + 1) * width + 1, dtype=np.uint64)
    bits = mixed(numbers[:, None] + GOLDEN * places)
    return np.asarray(((bits >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53)


def mixed(number: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Return SplitMix64's output at these states (Steele, Lea and Flood 2014, OOPSLA 49:453)."""
    number = number + GOLDEN
    number = (number ^ (number >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    number = (number ^ (number >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray(number ^ (number >> np.uint64(31)))
