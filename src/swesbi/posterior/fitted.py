"""A proposal fitted to weighted draws of a posterior, in a space in which it is near normal.

In a flow's base space a posterior that the flow nearly knows is nearly normal (the map of Parno and Marzouk
2018, SIAM/ASA J Uncertain Quantif 6:645, here learnt beforehand): what the flow knows of its shape is kept,
and errors of place and width are what is left. Of a recording that the flow does not know at all, the logit
of the prior's box may be the better space.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from swesbi.arrays import FloatArray
from swesbi.draws import normalised
from swesbi.posterior.space import Space
from swesbi.posterior.student import StudentMixture, StudentProposal, fitted_mixture, fitted_proposal


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
    """Fit a proposal to weighted draws phi (n, d) in the space in which a Student distribution is nearest.

    Nearest is the largest mean log density, which is the least divergence of the posterior from the proposal,
    up to a constant.
    """
    placed = [_placed(space, phi, log_weight) for space in spaces]
    best = max(range(len(spaces)), key=lambda number: placed[number].nearness)
    return FittedProposal(fitted_mixture(placed[best].u, placed[best].log_weight, seed), spaces[best])


class _Placed(NamedTuple):
    """Weighted draws that have a place in a space, and how near a Student distribution comes to them."""

    u: FloatArray
    log_weight: FloatArray
    nearness: float


def _placed(space: Space, phi: FloatArray, log_weight: FloatArray) -> _Placed:
    """Place weighted draws phi (n, d) in a space.

    Nearness is -inf where they lie so far apart that their covariance is singular in double precision.
    """
    u, log_slope = space.place(phi)
    known = np.isfinite(u).all(axis=1) & np.isfinite(log_slope)
    u, weight = u[known], log_weight[known]
    try:
        log_q = fitted_proposal(u, weight).log_density(u) + log_slope[known]
    except np.linalg.LinAlgError:
        return _Placed(u, weight, -np.inf)
    return _Placed(u, weight, float(normalised(weight) @ log_q))
