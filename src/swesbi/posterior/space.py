"""Spaces in which a posterior is near normal: the prior's logit, its normal scores, the base of a flow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol, runtime_checkable

import numpy as np
from scipy.special import ndtr, ndtri

from swesbi.base.arrays import FloatArray
from swesbi.posterior.importance import LikelihoodModel, Proposal
from swesbi.prior import (
    BoxPrior,
    bounds,
    from_logit,
    level,
    log_density,
    log_jacobian,
    quantile,
    to_logit,
)

LEAST_LEVEL: Final = 1e-16  # of a distribution function: beyond it, normal scores are infinite
LOG_ROOT_TWO_PI: Final = 0.5 * np.log(2.0 * np.pi)


@runtime_checkable
class Space(Protocol):
    """A space in which a posterior is near normal, and its map onto the prior's box."""

    def place(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return where phi (n, d) lie in it, u (n, d), and log |du / dphi| of shape (n,)."""

    def at(self, u: FloatArray) -> FloatArray:
        """Return the phi (n, d) of its points u (n, d)."""


class PlacedProposal(Proposal, Space, Protocol):
    """A proposal with the space in which the posterior is near normal."""

    def log_density_at(self, u: FloatArray, log_slope: FloatArray) -> FloatArray:
        """Return log q(phi) of phi at u (n, d), as ``place`` gives both; shape (n,)."""


@dataclass(frozen=True)
class LogitSpace:
    """The logit of the prior's box."""

    prior: BoxPrior

    def place(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return eta (n, d) of phi (n, d), and log |deta / dphi|."""
        eta = to_logit(phi, self.prior)
        return eta, -log_jacobian(eta, self.prior)

    def at(self, u: FloatArray) -> FloatArray:
        """Return phi (n, d) of eta (n, d), never onto the faces of the box."""
        return from_logit(u, self.prior)


@dataclass(frozen=True)
class ScoreSpace:
    """Normal scores of the prior's parameters, in which the prior is N(0, I)."""

    prior: BoxPrior

    def place(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the scores u (n, d) of phi (n, d), and log |du / dphi| of shape (n,)."""
        u = normal_scores(phi, self.prior)
        log_normal = (-0.5 * u**2 - LOG_ROOT_TWO_PI).sum(axis=1)
        return u, np.asarray(log_density(phi, self.prior) - log_normal)

    def at(self, u: FloatArray) -> FloatArray:
        """Return phi (n, d) of scores u (n, d), never on the faces of the box."""
        return of_scores(u, self.prior)


def normal_scores(phi: FloatArray, prior: BoxPrior) -> FloatArray:
    """Return Phi^-1(F(phi)) of phi (n, d), finite also on the bounds; shape (n, d)."""
    return np.asarray(ndtri(np.clip(level(phi, prior), LEAST_LEVEL, 1.0 - LEAST_LEVEL)))


def of_scores(z: FloatArray, prior: BoxPrior) -> FloatArray:
    """Return F^-1(Phi(z)) of normal scores z (n, d), never on the bounds; shape (n, d)."""
    low, high = bounds(prior)
    return np.asarray(np.clip(quantile(ndtr(z), prior), np.nextafter(low, high), np.nextafter(high, low)))


def log_posterior_in(space: Space, model: LikelihoodModel, u: FloatArray) -> FloatArray:
    """Return log p(u | data), not normalised, of points u (n, d) of a space; -inf where it failed; (n,)."""
    phi = space.at(u)
    _, log_slope = space.place(phi)
    log_posterior = log_density(phi, model.settings.prior) + model.log_likelihood(phi) - log_slope
    # far from all that a flow was trained on its map overflows
    return np.where(np.isnan(log_posterior), -np.inf, log_posterior)


def log_posterior_of_logit(model: LikelihoodModel, eta: FloatArray) -> FloatArray:
    """Return log p(eta | data), not normalised, of eta = logit of phi, (n, d); -inf where it failed; (n,)."""
    return log_posterior_in(LogitSpace(model.settings.prior), model, eta)
