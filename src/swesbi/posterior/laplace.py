"""The first proposal of a recording that no network knows: a normal approximation about its likeliest phi.

In normal scores the prior is N(0, I), and residuals z(u) of the speeds are independent standard normals at
the true u. So -2 log p(u | data) is, but for a constant, the sum of squares of (z(u), u). Its least value is
found by Gauss-Newton steps in a trust region (Levenberg and Marquardt; SciPy's ``least_squares``), and the
covariance there is (I + J^T J)^-1 with J = dz / du (Laplace's approximation, with the Gauss-Newton Hessian).
What it misses, later rounds of weighted draws make up for.
"""

from __future__ import annotations

from typing import Final, Protocol, runtime_checkable

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.posterior.fitted import FittedProposal
from swesbi.posterior.importance import HasPrior
from swesbi.posterior.space import ScoreSpace
from swesbi.posterior.student import StudentProposal
from swesbi.prior import draw_prior
from swesbi.seeds import generator

TRIED: Final = 400  # draws of the prior; the search begins with the likeliest
STARTS: Final = 2  # of these, beside the prior's centre
STEP: Final = 1e-3  # of central differences, in normal scores
EVALUATIONS: Final = 25  # of residuals by one search; most end after ten
TOLERANCE: Final = 1e-4  # relative: a mode is needed no better than its width
WIDER: Final = 1.5  # of the covariance, since the posterior's tails are not normal
FAILED: Final = 50.0  # a residual where the simulation failed, larger than any that is measured


@runtime_checkable
class ResidualModel(Protocol):
    """The model of one recording, by its residuals."""

    @property
    def settings(self) -> HasPrior:
        """Hold the prior."""

    def standardised(self, phi: FloatArray) -> FloatArray:
        """Return residuals of phi (n, d) that are standard normals at the true phi; (n, p), NaN: failed."""


def laplace_proposal(model: ResidualModel, seed: int) -> FittedProposal:
    """Return a wide Student distribution about the likeliest phi that is found, as a density over phi.

    The search begins at the prior's centre and at the likeliest of some draws of the prior.

    Args:
        model: Prior and residuals of the recording.
        seed: Of the draws of the prior.
    """
    prior = model.settings.prior
    space, d = ScoreSpace(prior), len(prior.parameters)
    tried = draw_prior(prior, TRIED, generator(seed, "laplace"))
    misfit = (_residuals(model, tried) ** 2).sum(axis=1)
    likeliest = tried[np.argsort(misfit, kind="stable")[:STARTS]]
    starts = [np.zeros(d), *space.place(likeliest)[0]]
    found = [_searched(model, space, start) for start in starts]
    _, mode, jacobian = min(found, key=lambda one: one[0])
    covariance = np.asarray(np.linalg.inv(jacobian.T @ jacobian), dtype=np.float64)
    return FittedProposal(StudentProposal(mode, WIDER * covariance), space)


def _searched(
    model: ResidualModel, space: ScoreSpace, start: FloatArray
) -> tuple[float, FloatArray, FloatArray]:
    """Return the least sum of squares from a start on, where it lies (d,), and its Jacobian (p + d, d)."""
    from scipy.optimize import least_squares

    steps = STEP * np.eye(len(start))

    def distance(u: FloatArray) -> FloatArray:
        return np.concatenate([_residuals(model, space.at(u[None]))[0], u])

    def slope(u: FloatArray) -> FloatArray:
        ahead, behind = np.split(_residuals(model, space.at(np.concatenate([u + steps, u - steps]))), 2)
        return np.vstack([(ahead - behind).T / (2.0 * STEP), np.eye(len(u))])

    result = least_squares(
        distance,
        start,
        jac=slope,
        ftol=TOLERANCE,
        xtol=TOLERANCE,
        gtol=TOLERANCE,
        max_nfev=EVALUATIONS,
    )
    return float(result.cost), np.asarray(result.x), np.asarray(result.jac)


def _residuals(model: ResidualModel, phi: FloatArray) -> FloatArray:
    z = model.standardised(phi)
    return np.where(np.isfinite(z), z, FAILED)
