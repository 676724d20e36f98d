"""The first proposal for a person's visits, from what each visit's own posterior says.

In normal scores the prior of one visit is N(0, I), and its posterior near N(m_v, C_v): what the recording
adds to the prior is the precision C_v^-1 - I and the linear term C_v^-1 m_v. A recording adds no width, so
the eigenvalues of C_v are at most 1. With z = M zeta (``visits.Coupling.mixing``) the posterior of all
visits is normal in zeta, of precision I + M^T diag_v(C_v^-1 - I) M and linear term M^T (C_v^-1 m_v)_v.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from swesbi.base.arrays import FloatArray
from swesbi.draws import equal_weights
from swesbi.persons.change.visits import Coupling
from swesbi.posterior.fitted import FittedProposal
from swesbi.posterior.space import ScoreSpace, normal_scores
from swesbi.posterior.student import RIDGE, WIDENING, StudentProposal
from swesbi.prior import BoxPrior

LEAST_VARIANCE = 1e-4  # of a normal score; nothing measured is known better


@dataclass(frozen=True)
class NormalVisit:
    """What one recording says by itself, as a normal posterior N(m, C) of scores whose prior is N(0, I).

    Attributes:
        mean: m; shape (d,).
        covariance: C, of eigenvalues at most 1; shape (d, d).
        effective_draws: Behind both.
    """

    mean: FloatArray
    covariance: FloatArray
    effective_draws: float

    @property
    def added_precision(self) -> FloatArray:
        """C^-1 - I, what the recording adds to the prior's; shape (d, d)."""
        return np.asarray(np.linalg.inv(self.covariance) - np.eye(len(self.mean)))

    @property
    def linear(self) -> FloatArray:
        """C^-1 m; shape (d,)."""
        return np.asarray(np.linalg.solve(self.covariance, self.mean))


def normal_visit(phi: FloatArray, prior: BoxPrior, effective_draws: float) -> NormalVisit:
    """Return the normal approximation of a visit's own posterior.

    Args:
        phi: Equally weighted draws; shape (m, d).
        prior: Of one visit.
        effective_draws: Behind the draws.
    """
    scores = normal_scores(phi, prior)
    weight = equal_weights(len(scores))
    mean = weight @ scores
    spread, axes = np.linalg.eigh((scores - mean).T @ ((scores - mean) * weight[:, None]))
    held = np.clip(spread, LEAST_VARIANCE, 1.0)
    return NormalVisit(mean, (axes * held) @ axes.T, effective_draws)


def joint_normal(visits: Sequence[NormalVisit], coupling: Coupling) -> tuple[FloatArray, FloatArray]:
    """Return mean (V d,) and covariance (V d, V d) of zeta given all recordings, as if all were normal."""
    mixing = coupling.mixing()
    added = block_diag(*(visit.added_precision for visit in visits))
    precision = np.eye(len(mixing)) + mixing.T @ added @ mixing
    covariance = np.linalg.inv(precision)
    covariance = 0.5 * (covariance + covariance.T)
    return covariance @ (mixing.T @ np.concatenate([visit.linear for visit in visits])), covariance


def first_proposal(visits: Sequence[NormalVisit], coupling: Coupling) -> FittedProposal:
    """Return a Student distribution of zeta about the normal approximation, as a density over psi."""
    mean, covariance = joint_normal(visits, coupling)
    scale = WIDENING * covariance + RIDGE * np.eye(len(mean))
    return FittedProposal(StudentProposal(mean, scale), ScoreSpace(coupling.joint))
