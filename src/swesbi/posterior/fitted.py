"""A proposal fitted to weighted draws of a posterior, in a space in which it is near normal.

It is of Student distributions, whose tails its weights need. Of few draws one is all that can be estimated.
Of more, a mixture follows a posterior that is bent or has two modes (Cappe, Douc, Guillin, Marin and Robert
2008, Stat Comput 18:447).

In a flow's base space a posterior that the flow nearly knows is nearly normal (the map of Parno and Marzouk
2018, SIAM/ASA J Uncertain Quantif 6:645, here learnt beforehand): what the flow knows of its shape is kept,
and errors of place and width are what is left. Of a recording that the flow does not know at all, the
prior's normal scores may be the better space.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.special import gammaln, logsumexp

from swesbi.base.arrays import FloatArray
from swesbi.draws import normalised
from swesbi.posterior.space import Space

DEGREES_OF_FREEDOM: Final = 8  # heavier tails than a posterior's, so that weights stay bounded
WIDENING: Final = 1.2  # of the covariance
RIDGE: Final = 1e-4  # least variance of a proposal, in eta
DRAWS_A_PARAMETER: Final = 2.5  # effective ones behind a proposal; a posterior with fewer is flattened
DRAWS_A_PART: Final = 100  # effective ones behind each part of a mixture
MOST_PARTS: Final = 4
STEPS: Final = 8  # of expectation maximisation; further ones gain nothing
SHRINKAGE: Final = 1.0  # weight of the common covariance in that of a part, in draws a parameter
SINGULAR: Final = 1e6 * 2.0**-52  # share of the largest variance below which one means nothing
NEGLIGIBLE: Final = 1e-3  # of the largest weight; draws below it do not move a fit


@dataclass(frozen=True)
class StudentProposal:
    """A multivariate Student distribution; mean (d,) and scale matrix (d, d)."""

    mean: FloatArray
    scale: FloatArray
    degrees_of_freedom: int = DEGREES_OF_FREEDOM

    def draw(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return eta of shape (count, d)."""
        return self._law.rvs(count, rng)

    def log_density(self, eta: FloatArray) -> FloatArray:
        """Return the log density at eta (n, d); shape (n,)."""
        return self._law.logpdf(eta)

    @cached_property
    def _law(self) -> StudentLaw:
        return student_law(self.mean, self.scale, self.degrees_of_freedom)


@dataclass(frozen=True)
class StudentLaw:
    """What ``scipy.stats.multivariate_t`` is, to the byte, without its import of a quarter of a second.

    The columns of ``whitening`` (d, d) take a distance from the mean to independent parts.
    """

    mean: FloatArray
    scale: FloatArray
    degrees_of_freedom: int
    whitening: FloatArray
    log_det: float

    def rvs(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Draw (count, d)."""
        stretch = rng.chisquare(self.degrees_of_freedom, size=count) / self.degrees_of_freedom
        normal = rng.multivariate_normal(np.zeros(len(self.mean)), self.scale, size=count)
        return np.asarray(self.mean + normal / np.sqrt(stretch)[:, None])

    def logpdf(self, x: FloatArray) -> FloatArray:
        """Return the log density at x (n, d); shape (n,)."""
        nu, width = self.degrees_of_freedom, len(self.mean)
        distance = np.square(np.dot(x - self.mean, self.whitening)).sum(axis=-1)
        norm = gammaln(0.5 * (nu + width)) - gammaln(0.5 * nu) - width / 2.0 * np.log(nu * np.pi)
        tail = -0.5 * (nu + width) * np.log(1 + (1.0 / nu) * distance)
        return np.asarray(norm - 0.5 * self.log_det + tail)


def student_law(mean: FloatArray, scale: FloatArray, degrees_of_freedom: int) -> StudentLaw:
    """Return a Student distribution; LinAlgError: its scale matrix is singular in double precision."""
    variance, along = eigh(scale)
    if variance.min() <= SINGULAR * np.abs(variance).max():
        raise np.linalg.LinAlgError("the scale matrix is singular")
    log_det = float(np.log(variance).sum())
    return StudentLaw(mean, scale, degrees_of_freedom, along * np.sqrt(1.0 / variance), log_det)


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


@dataclass(frozen=True)
class PlacedDraws:
    """Draws as they lie in a space, u of shape (n, d), with log |du / dphi| (n,)."""

    space: Space
    u: FloatArray
    log_slope: FloatArray

    @property
    def known(self) -> NDArray[np.bool_]:
        """Which have a place; shape (n,)."""
        return have_places(self.u, self.log_slope)

    def of(self, rows: NDArray[np.bool_]) -> PlacedDraws:
        """Return those of some rows (n,)."""
        return PlacedDraws(self.space, self.u[rows], self.log_slope[rows])

    def with_more(self, more: PlacedDraws) -> PlacedDraws:
        """Return these and further draws."""
        return PlacedDraws(
            self.space,
            np.concatenate([self.u, more.u]),
            np.concatenate([self.log_slope, more.log_slope]),
        )


def have_places(u: FloatArray, log_slope: FloatArray) -> NDArray[np.bool_]:
    """Tell which draws have a place: far from all that a flow was trained on its map overflows; (n,)."""
    return np.isfinite(u).all(axis=1) & np.isfinite(log_slope)


def placed_in(space: Space, phi: FloatArray) -> PlacedDraws:
    """Return draws phi (n, d) as they lie in a space."""
    u, log_slope = space.place(phi)
    return PlacedDraws(space, u, log_slope)


@dataclass(frozen=True)
class FittedProposal:
    """A Student distribution in a space, or a mixture of them, as a density over phi."""

    student: StudentProposal | StudentMixture
    space: Space

    def draw(self, draws: int, seed: int) -> FloatArray:
        """Draw phi (draws, d)."""
        return self.space.at(self.student.draw(draws, np.random.default_rng(seed)))

    def log_density(self, phi: FloatArray) -> FloatArray:
        """Return log q(phi) of phi (n, d); shape (n,)."""
        return self.log_density_at(*self.place(phi))

    def log_density_at(self, u: FloatArray, log_slope: FloatArray) -> FloatArray:
        """Return log q(phi) = log q(u) + log |du / dphi| of phi at u (n, d) of its space; shape (n,)."""
        known = have_places(u, log_slope)
        log_density = np.full(len(known), -np.inf)  # nothing is drawn where nothing can be placed
        log_density[known] = self.student.log_density(u[known]) + log_slope[known]
        return log_density

    def place(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return where phi (n, d) lie in its space, and log |du / dphi| of shape (n,)."""
        return self.space.place(phi)

    def at(self, u: FloatArray) -> FloatArray:
        """Return the phi (n, d) of points u (n, d) of its space."""
        return self.space.at(u)


def fit_in_nearest(draws: Sequence[PlacedDraws], log_weight: FloatArray) -> FittedProposal:
    """Fit a proposal to weighted draws in the space in which Student distributions come nearest to them.

    Nearest is the largest mean log density, which is the least divergence of the posterior from the proposal,
    up to a constant. In the last space all draws have a place. LinAlgError: their covariance is singular in
    double precision in every space.
    """
    fits = [fit for placed in draws if (fit := _fitted(placed, log_weight)) is not None]
    if not fits:
        raise np.linalg.LinAlgError("the draws' covariance is singular in every space")
    return max(fits, key=lambda fit: fit[1])[0]


def _fitted(placed: PlacedDraws, log_weight: FloatArray) -> tuple[FittedProposal, float] | None:
    """Return a proposal in one space, and its mean log density.

    None where draws lie so far apart that their covariance is singular in double precision.
    """
    known = placed.known
    draws, log_weight = placed.of(known), log_weight[known]
    try:
        proposal = FittedProposal(fitted_proposal(draws.u, log_weight), placed.space)
        return proposal, float(normalised(log_weight) @ proposal.log_density_at(draws.u, draws.log_slope))
    except np.linalg.LinAlgError:
        return None
