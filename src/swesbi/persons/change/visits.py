"""The joint prior and likelihood of a person's visits, in coordinates in which the prior is independent.

The prior of each visit's phi_v stays what it is alone: independent bounded log-Gaussians. Visits of one
person are tied by a Gaussian copula. With F the distribution function of a parameter and rho its share,
the normal scores z_v = Phi^-1(F(phi_v)) of V visits are standard normals, any two of correlation rho.
Let L be the Cholesky factor of their correlation matrix and z_v = sum_w L_vw zeta_w. Then zeta is
independent, and so is

    psi_w = F^-1(Phi(zeta_w)),

which has the prior of V strangers. psi of V d parameters takes the place of phi wherever a posterior is made;
where rho = 0 it is phi itself, and where rho = 1 all visits have the value of the first and the others' psi
play no part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import PredictedSpeeds, WallPhases
from swesbi.persons.change.likelihood import shared_errors, stacked_covariance, stacked_log_density
from swesbi.persons.cohort.model import PriorAlone
from swesbi.posterior.space import normal_scores, of_scores
from swesbi.prior import BoxPrior, SomeParameters


def equal_correlation_factor(share: float, visits: int) -> FloatArray:
    """Return the lower Cholesky factor of a correlation matrix whose entries are all ``share``; (V, V).

    Column by column, and also at a share of 1, where the matrix has rank 1: the other columns are zero.
    """
    factor = np.zeros((visits, visits))
    left = np.full((visits, visits), share) + (1.0 - share) * np.eye(visits)
    for column in range(visits):
        pivot = left[column, column]
        if pivot <= np.finfo(float).eps * visits:
            break
        factor[column:, column] = left[column:, column] / np.sqrt(pivot)
        left = left - np.outer(factor[:, column], factor[:, column])
    return factor


@dataclass(frozen=True)
class Coupling:
    """How the phi of V visits follow from psi.

    Attributes:
        prior: Of one visit, or of some of its parameters; d parameters.
        shares: Of each parameter; shape (d,).
        visits: V.
    """

    prior: BoxPrior
    shares: FloatArray
    visits: int

    @property
    def joint(self) -> SomeParameters:
        """The prior of psi: that of one visit, as often as there are visits."""
        return SomeParameters(self.prior.parameters * self.visits)

    @cached_property
    def factors(self) -> FloatArray:
        """Cholesky factors of the parameters; shape (d, V, V)."""
        return np.stack([equal_correlation_factor(share, self.visits) for share in self.shares])

    def phi(self, psi: FloatArray) -> FloatArray:
        """Return the phi (V, n, d) of psi (n, V d)."""
        parts = psi.reshape(len(psi), self.visits, -1)
        phi = parts.swapaxes(0, 1).copy()
        shared = np.flatnonzero(self.shares)
        if not len(shared):
            return phi
        tied = SomeParameters(tuple(self.prior.parameters[j] for j in shared))
        zeta = np.stack([normal_scores(parts[:, w, shared], tied) for w in range(self.visits)])
        z = np.einsum("jvw,wnj->vnj", self.factors[shared], zeta)
        # the first visit's factor is 1: its parameters stay as they are, to the bit
        for visit in range(1, self.visits):
            phi[visit][:, shared] = of_scores(z[visit], tied)
        return phi

    def psi(self, phi: FloatArray) -> FloatArray:
        """Return the psi (n, V d) of phi (V, n, d), where no share is 1; within the prior's box."""
        psi = np.stack(list(phi), axis=1)
        shared = np.flatnonzero(self.shares)
        if len(shared):
            tied = SomeParameters(tuple(self.prior.parameters[j] for j in shared))
            z = np.stack([normal_scores(each[:, shared], tied) for each in phi])
            zeta = np.einsum("jvw,wnj->vnj", np.linalg.inv(self.factors[shared]), z)
            for visit in range(1, self.visits):
                psi[:, visit, shared] = of_scores(zeta[visit], tied)
        return np.asarray(psi.reshape(len(psi), -1))

    def correlation(self, visit: int, other: int) -> FloatArray:
        """Return the correlation of each tied parameter's scores between two visits; 1 with itself; (k,)."""
        tied = self.shares[self.shares > 0.0]
        return np.ones_like(tied) if visit == other else tied

    def mixing(self) -> FloatArray:
        """Return M of z = M zeta, scores of all parameters visit by visit; shape (V d, V d)."""
        number = len(self.shares)
        mixing = np.zeros((self.visits, number, self.visits, number))
        parameter = np.arange(number)
        mixing[:, parameter, :, parameter] = self.factors
        return mixing.reshape(self.visits * number, -1)


@dataclass(frozen=True)
class VisitsModel:
    """The recordings of one person's visits under one experiment: prior and exact likelihood of psi.

    Attributes:
        models: The model of each visit's recording, all under the same settings.
        phase_index: Numbers of its measured phases in the protocol, by visit; shape (p_v,) each.
        coupling: How phi follows from psi.
        discrepancy_share: Share of the discrepancy's variance that visits have in common.
    """

    models: tuple[SpeedModel, ...]
    phase_index: tuple[IntArray, ...]
    coupling: Coupling
    discrepancy_share: float

    @property
    def settings(self) -> PriorAlone:
        """Hold the prior."""
        return PriorAlone(self.coupling.joint)

    def log_likelihood(self, psi: FloatArray) -> FloatArray:
        """Return log p(all recordings | psi) of psi (n, V d), -inf where a simulation failed; shape (n,)."""
        phi = self.phi(psi)
        walls = [model.wall(each) for model, each in zip(self.models, phi, strict=True)]
        return self.log_likelihood_of(self.predict_at(phi, walls))

    def predict_at(self, phi: FloatArray, walls: Sequence[WallPhases]) -> list[PredictedSpeeds]:
        """Return the noiseless log speeds of phi (V, n, d) whose walls are given, by visit."""
        return [model.predict_at(*each) for model, *each in zip(self.models, phi, walls, strict=True)]

    def log_likelihood_of(self, predicted: Sequence[PredictedSpeeds]) -> FloatArray:
        """Return log p(all recordings | psi) of predicted speeds, by visit; shape (n,)."""
        recordings = [model.recording for model in self.models]
        discrepancy = self.models[0].settings.discrepancy
        covariance = stacked_covariance(
            predicted, recordings, self.phase_index, discrepancy, self.discrepancy_share
        )
        distance = [
            np.log(recording.speed_m_s) - each.log_speed
            for recording, each in zip(recordings, predicted, strict=True)
        ]
        return stacked_log_density(np.hstack(distance), covariance)

    def phi(self, psi: FloatArray) -> FloatArray:
        """Return the phi (V, n, d) of psi (n, V d)."""
        return self.coupling.phi(psi)

    def error_covariance(self) -> FloatArray:
        """Return the covariance of all log speeds without errors in timing; (q, q)."""
        recordings = [model.recording for model in self.models]
        discrepancy = self.models[0].settings.discrepancy
        shared = shared_errors(recordings, self.phase_index, discrepancy, self.discrepancy_share)
        own = np.concatenate([recording.relative_se for recording in recordings])
        return np.asarray(shared + np.diag(own**2 + discrepancy.speed_fraction**2))


def visits_model(
    models: Sequence[SpeedModel],
    phase_index: Sequence[IntArray],
    shares: FloatArray,
    discrepancy_share: float,
) -> VisitsModel:
    """Build the model of a person's visits.

    Args:
        models: The model of each visit's recording.
        phase_index: Numbers of its measured phases in the protocol, by visit.
        shares: Of each parameter of one visit; shape (d,).
        discrepancy_share: Of the discrepancy's variance.

    Raises:
        ValueError: There are fewer than two visits, or they have different settings.
    """
    if len(models) < 2:
        raise ValueError(f"{len(models)} visit of one person: a change needs two")
    if any(model.settings != models[0].settings for model in models):
        raise ValueError("visits of one person have different models; infer both by one experiment")
    coupling = Coupling(models[0].settings.prior, shares, len(models))
    return VisitsModel(tuple(models), tuple(phase_index), coupling, discrepancy_share)
