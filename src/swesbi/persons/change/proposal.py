"""The space of both visits' networks, in which the posterior of both is near normal.

A flow takes the posterior of one recording to about N(0, I), whatever its shape. In the product of the
spaces of both, u = (u_1, u_2), the posterior of both is the product of their own posteriors, each near
N(m_v, C_v), times what ties them: the copula of the shared parameters, whose logarithm is -1/2 z^T (R^-1
- I) z in their scores z, and the ratio of the normal density of all errors r to those of each visit,
which is of the same form. Scores and residuals y are about a + B u (a regression over draws), so with G
the matrix of both forms the posterior of both has the precision and the linear term

    P = blockdiag(C_v^-1) + B^T H B,    h = (C_v^-1 m_v)_v - B^T H a,    H = G (I + S G)^-1,

S being the covariance of what the regression leaves over: what measures the hearts is integrated out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from swesbi.base.arrays import FloatArray
from swesbi.measurement.likelihood import SpeedModel
from swesbi.persons.change.visits import Coupling, VisitsModel
from swesbi.posterior.fitted import FittedProposal
from swesbi.posterior.space import ScoreSpace, Space, normal_scores
from swesbi.posterior.student import RIDGE, WIDENING, StudentProposal

FITTED = 2000  # draws behind the fit of each visit
DEGREES_OF_FREEDOM = 25  # of thirty parameters: with 8 most draws lie too far out, and half as many count
LEAST_PRECISION = 0.3  # of a direction of u: the prior of both is never much wider than those of each


@dataclass(frozen=True)
class JoinedSpace:
    """The spaces of both visits side by side, as a space of psi.

    Attributes:
        spaces: Of each visit's hearts.
        coupling: How these follow from psi.
    """

    spaces: tuple[Space, ...]
    coupling: Coupling

    def place(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return where psi (n, V d) lie, u (n, V d), and log |du / dpsi| of shape (n,)."""
        parts = self.coupling.phi(phi)
        placed = [space.place(part) for space, part in zip(self.spaces, parts, strict=True)]
        log_slope = np.sum([slope for _, slope in placed], axis=0) + self._coupled_slope(phi, parts)
        return np.hstack([u for u, _ in placed]), np.asarray(log_slope)

    def at(self, u: FloatArray) -> FloatArray:
        """Return psi (n, V d) of points u (n, V d)."""
        parts = np.split(u, self.coupling.visits, axis=1)
        return self.coupling.psi(
            np.stack([space.at(part) for space, part in zip(self.spaces, parts, strict=True)])
        )

    def _coupled_slope(self, psi: FloatArray, phi: FloatArray) -> FloatArray:
        """Return log |dphi / dpsi|: psi to independent scores, to those of the visits, to phi."""
        diagonal = np.diagonal(self.coupling.factors, axis1=1, axis2=2)
        to_scores = ScoreSpace(self.coupling.joint).place(psi)[1]
        back = sum(ScoreSpace(self.coupling.prior).place(part)[1] for part in phi)
        return np.asarray(to_scores + np.log(diagonal).sum() - back)


def joined_proposal(
    visits: VisitsModel, phi: Sequence[FloatArray], spaces: Sequence[Space]
) -> FittedProposal:
    """Return a Student distribution in the joined space about the normal approximation of the posterior.

    Args:
        visits: Of both recordings.
        phi: Equally weighted draws of each visit's own posterior; shape (m, d) each.
        spaces: Space of each visit's hearts, that of its network.
    """
    fits = [
        _fit(one, each[:FITTED], space, visits.coupling.shares)
        for one, each, space in zip(visits.models, phi, spaces, strict=True)
    ]
    offset = np.concatenate([fit.offset for fit in fits])
    slopes = block_diag(*(fit.slopes for fit in fits))
    added = _added_precision(visits, [fit.tied for fit in fits])
    added = added @ np.linalg.inv(np.eye(len(added)) + block_diag(*(fit.rest for fit in fits)) @ added)
    precision = block_diag(*(fit.precision for fit in fits)) + slopes.T @ added @ slopes
    linear = np.concatenate([fit.precision @ fit.mean for fit in fits]) - slopes.T @ added @ offset
    spread, axes = np.linalg.eigh(precision)
    covariance = (axes / np.maximum(spread, LEAST_PRECISION)) @ axes.T
    student = StudentProposal(covariance @ linear, WIDENING * covariance, DEGREES_OF_FREEDOM)
    return FittedProposal(student, JoinedSpace(tuple(spaces), visits.hearts))


@dataclass(frozen=True)
class _Fit:
    """A visit in its space: N(mean, precision^-1), and what ties it to others as offset + slopes u.

    The latter are k scores of tied parameters, then p residuals of log speeds. What measures a heart is not
    in u, and scatters them with the covariance ``rest``.
    """

    mean: FloatArray
    precision: FloatArray
    offset: FloatArray
    slopes: FloatArray
    rest: FloatArray
    tied: int


def _fit(model: SpeedModel, phi: FloatArray, space: Space, shares: FloatArray) -> _Fit:
    prior = model.settings.prior
    u, _ = space.place(prior.heart(phi))
    residuals = np.log(model.recording.speed_m_s) - model.predict(phi).log_speed
    tied = np.flatnonzero(shares)
    tying = np.hstack([normal_scores(phi, prior)[:, tied], residuals])
    known = np.isfinite(u).all(axis=1) & np.isfinite(tying).all(axis=1)
    u, tying = u[known], tying[known]
    design = np.column_stack([np.ones(len(u)), u])
    line = np.asarray(np.linalg.lstsq(design, tying, rcond=None)[0])
    precision = np.asarray(np.linalg.inv(np.cov(u.T) + RIDGE * np.eye(u.shape[1])))
    rest = np.asarray(np.cov((tying - design @ line).T))
    return _Fit(u.mean(axis=0), precision, line[0], line[1:].T, rest, len(tied))


def _added_precision(model: VisitsModel, tied: Sequence[int]) -> FloatArray:
    """Return what ties add to the precision of scores and residuals, in the order of :class:`_Fit`.

    R^-1 - I of the scores, and the inverse of the covariance of all errors less those of each visit.
    """
    shares = np.diag(model.coupling.shares[model.coupling.shares > 0.0])
    own = np.eye(len(shares))
    correlation = np.block([[own, shares], [shares, own]])
    scores = np.linalg.inv(correlation) - np.eye(len(correlation))
    covariance = model.error_covariance()
    sizes = [len(index) for index in model.phase_index]
    starts = np.cumsum([0, *sizes])
    alone = [np.linalg.inv(covariance[a:b, a:b]) for a, b in zip(starts[:-1], starts[1:], strict=True)]
    errors = np.linalg.inv(covariance) - block_diag(*alone)
    whole = block_diag(scores, errors)
    # scores of all visits, then residuals of all; wanted is visit by visit
    visit = np.concatenate([np.repeat(np.arange(len(tied)), tied), np.repeat(np.arange(len(sizes)), sizes)])
    order = np.argsort(visit, kind="stable")
    return np.asarray(whole[np.ix_(order, order)])
