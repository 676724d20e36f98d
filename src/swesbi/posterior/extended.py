"""A proposal for one parameter more than a network knows: its own draws, the further one from its prior."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri

from swesbi.base.arrays import FloatArray
from swesbi.posterior.fitted import FittedProposal, fit_in_nearest, placed_in
from swesbi.posterior.importance import WeightedDraws
from swesbi.posterior.space import PlacedProposal, ScoreSpace
from swesbi.prior import JointPriorSettings, ParameterPrior, bounds, draw_prior, level, log_density, quantile
from swesbi.seeds import generator, integer_seed

LOG_ROOT_TWO_PI = 0.5 * np.log(2.0 * np.pi)


@dataclass(frozen=True)
class OnePrior:
    """The prior of one parameter alone."""

    parameter: ParameterPrior

    @property
    def parameters(self) -> tuple[ParameterPrior, ...]:
        """The one."""
        return (self.parameter,)


@dataclass(frozen=True)
class ExtendedProposal:
    """A proposal q(known) times the prior of the parameter that stands in one column of phi beside them.

    Attributes:
        known: q, of d - 1 parameters.
        prior: Of the further one.
        column: Where it stands among the d.
    """

    known: PlacedProposal
    prior: OnePrior
    column: int

    def draw(self, draws: int, seed: int) -> FloatArray:
        """Draw phi; shape (draws, d)."""
        known = self.known.draw(draws, integer_seed(seed, "extended", "known"))
        further = quantile(generator(seed, "extended", "prior").random((draws, 1)), self.prior)
        return self._joined(known, self._inside(further))

    def log_density(self, phi: FloatArray) -> FloatArray:
        """Return log q(phi), per unit of phi, of phi (n, d); shape (n,)."""
        known, further = self._parted(phi)
        return self.known.log_density(known) + log_density(further, self.prior)

    def place(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return phi (n, d) in the base space, u (n, d), with log |du / dphi| of shape (n,).

        The further parameter lies at its normal score, where its prior is the standard normal distribution.
        """
        known, further = self._parted(phi)
        u, log_slope = self.known.place(known)
        score = ndtri(level(further, self.prior))
        log_normal = -0.5 * score[:, 0] ** 2 - LOG_ROOT_TWO_PI
        return self._joined(u, score), log_slope + log_density(further, self.prior) - log_normal

    def at(self, u: FloatArray) -> FloatArray:
        """Return the phi (n, d) of points u (n, d) of that space, never onto bounds of the further one."""
        known, score = self._parted(u)
        return self._joined(self.known.at(known), self._inside(quantile(ndtr(score), self.prior)))

    def _parted(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        return np.delete(values, self.column, axis=1), values[:, [self.column]]

    def _joined(self, known: FloatArray, further: FloatArray) -> FloatArray:
        return np.insert(known, self.column, further[:, 0], axis=1)

    def _inside(self, further: FloatArray) -> FloatArray:
        low, high = bounds(self.prior)
        return np.asarray(np.clip(further, np.nextafter(low, high), np.nextafter(high, low)))


def fitted_beside(known: WeightedDraws, prior: JointPriorSettings, name: str, seed: int) -> FittedProposal:
    """Return a proposal fitted to weighted draws, with a further parameter drawn from its prior.

    Args:
        known: Draws of the others, in the order of the prior.
        prior: Of all.
        name: The further parameter.
        seed: Of its draws.
    """
    column = prior.names.index(name)
    further = draw_prior(OnePrior(prior.parameters[column]), len(known.phi), generator(seed, "extended"))
    phi = np.insert(known.phi, column, further[:, 0], axis=1)
    return fit_in_nearest([placed_in(ScoreSpace(prior), phi)], known.log_weight)


def extended_proposal(known: PlacedProposal, prior: JointPriorSettings, name: str) -> ExtendedProposal:
    """Return a proposal for a prior that has one parameter more than ``known``.

    Args:
        known: A proposal of the others, in the order of the prior.
        prior: Of all.
        name: The further parameter.

    Raises:
        ValueError: The prior does not free it.
    """
    if name not in prior.names:
        raise ValueError(f"{name}: the prior frees no such parameter, only {', '.join(prior.names)}")
    column = prior.names.index(name)
    return ExtendedProposal(known, OnePrior(prior.parameters[column]), column)
