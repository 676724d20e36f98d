"""A proposal fitted to weighted draws of a posterior, in a space in which it is near normal.

In a flow's base space a posterior that the flow nearly knows is nearly normal (the map of Parno and Marzouk
2018, SIAM/ASA J Uncertain Quantif 6:645, here learnt beforehand): what the flow knows of its shape is kept,
and errors of place and width are what is left. Of a recording that the flow does not know at all, the logit
of the prior's box may be the better space.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from swesbi.arrays import FloatArray
from swesbi.draws import normalised
from swesbi.posterior.space import Space
from swesbi.posterior.student import StudentMixture, StudentProposal, fitted_mixture


@dataclass(frozen=True)
class FittedProposal:
    """A Student distribution, or a mixture of them, in a space, as a density over phi."""

    student: StudentProposal | StudentMixture
    space: Space

    def draw(self, draws: int, seed: int) -> FloatArray:
        """Draw phi (draws, d)."""
        return self.space.at(self.student.draw(draws, np.random.default_rng(seed)))

    def log_density(self, phi: FloatArray) -> FloatArray:
        """Return log q(phi) = log q(u) + log |du / dphi| of phi (n, d); shape (n,)."""
        u, log_slope = self.space.place(phi)
        # far from all that a flow was trained on its map overflows; nothing is drawn there
        known = np.isfinite(u).all(axis=1) & np.isfinite(log_slope)
        log_density = np.full(len(phi), -np.inf)
        log_density[known] = self.student.log_density(u[known]) + log_slope[known]
        return log_density

    def place(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return where phi (n, d) lie in its space, and log |du / dphi| of shape (n,)."""
        return self.space.place(phi)

    def at(self, u: FloatArray) -> FloatArray:
        """Return the phi (n, d) of points u (n, d) of its space."""
        return self.space.at(u)


def fit_in_nearest(
    spaces: Sequence[Space], phi: FloatArray, log_weight: FloatArray, seed: int
) -> FittedProposal:
    """Fit a proposal to weighted draws phi (n, d) in each space, and return the one nearest to them.

    Nearest is the largest mean log density, which is the least divergence of the posterior from the proposal,
    up to a constant.
    """
    fits = [_fitted_in(space, phi, log_weight, seed) for space in spaces]
    best = max(range(len(fits)), key=lambda number: fits[number][1])
    return fits[best][0]


def _fitted_in(
    space: Space, phi: FloatArray, log_weight: FloatArray, seed: int
) -> tuple[FittedProposal, float]:
    """Return what is fitted in a space, and its mean log density over the weighted draws phi (n, d).

    That is -inf where the draws lie so far apart in it that their covariance is singular in double precision.
    """
    u, log_slope = space.place(phi)
    known = np.isfinite(u).all(axis=1) & np.isfinite(log_slope)
    mixture = fitted_mixture(u[known], log_weight[known], seed)
    try:
        log_q = mixture.log_density(u[known]) + log_slope[known]
    except np.linalg.LinAlgError:
        return FittedProposal(mixture, space), -np.inf
    return FittedProposal(mixture, space), float(normalised(log_weight[known]) @ log_q)
