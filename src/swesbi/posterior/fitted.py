"""A proposal fitted to weighted draws of a posterior, in a space in which it is near normal.

In a flow's base space a posterior that the flow nearly knows is nearly normal (the map of Parno and Marzouk
2018, SIAM/ASA J Uncertain Quantif 6:645, here learnt beforehand): what the flow knows of its shape is kept,
and errors of place and width are what is left. Of a recording that the flow does not know at all, the
prior's normal scores may be the better space.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import FloatArray
from swesbi.draws import normalised
from swesbi.posterior.space import Space
from swesbi.posterior.student import StudentMixture, StudentProposal, fitted_proposal


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
