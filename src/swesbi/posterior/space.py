"""Spaces in which a posterior is near normal: the logit of the prior's box, and the base space of a flow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.posterior.importance import LikelihoodModel, Proposal
from swesbi.prior import BoxPrior, from_logit, log_density, log_jacobian, to_logit


@runtime_checkable
class Space(Protocol):
    """A space in which a posterior is near normal, and its map onto the prior's box."""

    def place(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return where phi (n, d) lie in it, u (n, d), and log |du / dphi| of shape (n,)."""

    def at(self, u: FloatArray) -> FloatArray:
        """Return the phi (n, d) of its points u (n, d)."""


class PlacedProposal(Proposal, Space, Protocol):
    """A proposal with the space in which the posterior is near normal."""


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
