"""The first proposal of a recording that no network knows: normal approximations about its likeliest phi.

In normal scores the prior is N(0, I), and residuals z(u) of the speeds are independent standard normals at
the true u. So -2 log p(u | data) is, but for a constant, the sum of squares of (z(u), u). Its least value is
found by Gauss-Newton steps in a trust region (Levenberg and Marquardt; SciPy's ``least_squares``), and the
covariance there is (I + J^T J)^-1 with J = dz / du (Laplace's approximation, with the Gauss-Newton Hessian).
Searches from several starts may end in several modes, which later rounds would not find: each has a part.
What its normal approximation misses, later rounds of weighted draws make up for.
"""

from __future__ import annotations

from typing import Final, Protocol, runtime_checkable

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.draws import normalised
from swesbi.posterior.fitted import FittedProposal, StudentMixture, StudentProposal
from swesbi.posterior.importance import HasPrior
from swesbi.posterior.space import ScoreSpace
from swesbi.prior import draw_prior
from swesbi.seeds import generator

TRIED: Final = 2000  # draws of the prior; the searches begin with the likeliest
STARTS: Final = 11  # of these, beside the prior's centre
STEP: Final = 1e-3  # of central differences, in normal scores
EVALUATIONS: Final = 25  # of residuals by one search; most end after ten
TOLERANCE: Final = 1e-4  # relative: a mode is needed no better than its width
WIDER: Final = 1.5  # of the covariance, since the posterior's tails are not normal
EVIDENCE_POWER: Final = 0.5  # below one, since the evidence of a mode is approximate as well
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
    """Return wide Student distributions about the likeliest phi that are found, as a density over phi.

    The searches begin at the prior's centre and at the likeliest of some draws of the prior. The share of
    each is a power of the evidence that its approximation gives.
    """
    prior = model.settings.prior
    space, d = ScoreSpace(prior), len(prior.parameters)
    tried = draw_prior(prior, TRIED, generator(seed, "laplace"))
    misfit = (_residuals(model, tried) ** 2).sum(axis=1)
    likeliest = tried[np.argsort(misfit, kind="stable")[:STARTS]]
    found = [_searched(model, space, start) for start in (np.zeros(d), *space.place(likeliest)[0])]
    precision = [jacobian.T @ jacobian for _, _, jacobian in found]
    half_log_det = np.array([0.5 * np.linalg.slogdet(each)[1] for each in precision])
    log_evidence = -np.array([cost for cost, _, _ in found]) - half_log_det
    parts = tuple(
        StudentProposal(mode, WIDER * np.asarray(np.linalg.inv(each), dtype=np.float64))
        for (_, mode, _), each in zip(found, precision, strict=True)
    )
    return FittedProposal(StudentMixture(normalised(EVIDENCE_POWER * log_evidence), parts), space)


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
