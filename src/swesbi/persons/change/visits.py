"""The joint prior and likelihood of a person's visits, in coordinates in which the prior is independent.

The prior of each visit's phi_v stays what it is alone: independent bounded log-Gaussians. Visits of one
person are tied by a Gaussian copula. With F the distribution function of a parameter and rho < 1 its share,
the normal scores z_v = Phi^-1(F(phi_v)) of V visits are standard normals, any two of correlation rho.
Let L be the Cholesky factor of their correlation matrix and z_v = sum_w L_vw zeta_w. Then zeta is
independent, and so is

    psi_w = F^-1(Phi(zeta_w)),

which has the prior of V strangers. psi of V d parameters takes the place of phi wherever a posterior is made;
where rho = 0 it is phi itself. As for one recording (``posterior.hearts``), samplers move in the k parameters
of each heart, and what measures them is integrated out of all visits together: of the o parameters of the
measurement the scores at visit v are sum_w L_vw zeta_w.

All log speeds are normal given the walls. Within a visit their covariance is what it is alone
(``measurement.likelihood``); between visits it is the shared part of the discrepancy, share delta^2, where
the phase is the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from scipy.linalg import block_diag

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.measurement.likelihood import SpeedModel, log_speed_sd
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.measurement.shared_error import Errors
from swesbi.measurement.speeds import PredictedSpeeds, SpeedRecording, WallPhases
from swesbi.persons.cohort.model import PriorAlone
from swesbi.posterior.hearts import completed_heart, linear_speeds
from swesbi.posterior.marginal import Marginal
from swesbi.posterior.space import normal_scores, of_scores
from swesbi.prior import BoxPrior, JointPriorSettings, OperatorPrior, SimulatedPrior, SomeParameters

ROWS_AT_ONCE: Final = 2000  # of factorisations of their own: 40 phases take 26 MB
Walls = tuple[WallPhases, ...]


@dataclass(frozen=True)
class Coupling:
    """How the phi of V visits follow from psi, by the shares (d,) of their d parameters, each below 1.

    ``prior`` is of one visit, or of some of its parameters.
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
        """Cholesky factors of the correlations of the parameters; shape (d, V, V)."""
        share = self.shares[:, None, None]
        left = share + (1.0 - share) * np.eye(self.visits)
        factors = np.zeros_like(left)
        for column in range(self.visits):
            pivot = np.sqrt(left[:, column, column])
            factors[:, column:, column] = left[:, column:, column] / pivot[:, None]
            left = left - factors[:, :, column, None] * factors[:, None, :, column]
        return factors

    def phi(self, psi: FloatArray) -> FloatArray:
        """Return the phi (V, n, d) of psi (n, V d)."""
        return self._mixed(psi.reshape(len(psi), self.visits, -1).swapaxes(0, 1), self.factors)

    def psi(self, phi: FloatArray) -> FloatArray:
        """Return the psi (n, V d) of phi (V, n, d); within the prior's box."""
        psi = self._mixed(phi, np.asarray(np.linalg.inv(self.factors), np.float64))
        return np.asarray(psi.swapaxes(0, 1).reshape(phi.shape[1], -1))

    def _mixed(self, values: FloatArray, factors: FloatArray) -> FloatArray:
        """Return values (V, n, d) whose scores are mixed by factors (d, V, V), the others kept."""
        values, shared = values.copy(), np.flatnonzero(self.shares)
        if not len(shared):
            return values
        tied = SomeParameters(tuple(self.prior.parameters[j] for j in shared))
        scores = np.stack([normal_scores(each[:, shared], tied) for each in values])
        mixed = np.einsum("jvw,wnj->vnj", factors[shared], scores)
        # the first visit's factor is 1: its parameters stay as they are, to the bit
        for visit in range(1, self.visits):
            values[visit][:, shared] = of_scores(mixed[visit], tied)
        return values

    def of(self, part: SimulatedPrior | OperatorPrior, names: Sequence[str]) -> Coupling:
        """Return the coupling of some of the parameters, which have these ``names`` in all."""
        shares = dict(zip(names, self.shares, strict=True))
        return Coupling(part, np.array([shares[name] for name in part.names]), self.visits)


@dataclass(frozen=True)
class VisitsModel(Marginal[Walls]):
    """The recordings of one person's visits under one experiment: prior and exact likelihood.

    Points are the hearts of V visits in the coordinates of psi, V k parameters. ``phase_index`` has the
    numbers of each visit's measured phases in the protocol, (p_v,) each.
    """

    models: tuple[SpeedModel, ...]
    phase_index: tuple[IntArray, ...]
    coupling: Coupling
    discrepancy_share: float

    @property
    def prior(self) -> SomeParameters:
        """The prior of psi, V d parameters."""
        return self.coupling.joint

    @property
    def settings(self) -> PriorAlone:
        """Hold the prior of the hearts."""
        return PriorAlone(self.hearts.joint)

    @property
    def width(self) -> int:
        """Number of parameters of the measurements of all visits."""
        return len(self.of_one.operator.parameters) * self.coupling.visits

    @property
    def of_one(self) -> JointPriorSettings:
        """The prior of one visit."""
        return self.models[0].settings.prior

    @property
    def recordings(self) -> tuple[SpeedRecording, ...]:
        """The recording of each visit."""
        return tuple(model.recording for model in self.models)

    @property
    def discrepancy(self) -> DiscrepancySettings:
        """That of each visit."""
        return self.models[0].settings.discrepancy

    @cached_property
    def hearts(self) -> Coupling:
        """How the hearts of the visits follow from their part of psi."""
        return self.coupling.of(self.of_one.simulated, self.of_one.names)

    @cached_property
    def shared(self) -> FloatArray:
        """Covariance of what log speeds of all visits share, without what a phase has for itself; (q, q)."""
        within = block_diag(*(each.shared @ each.shared.T for each in self.recordings))
        phase, sizes = np.concatenate(self.phase_index), [len(index) for index in self.phase_index]
        visit = np.repeat(np.arange(self.coupling.visits), sizes)
        between = (phase[:, None] == phase) & (visit[:, None] != visit)
        return np.asarray(within + self.shared_variance * between)

    @property
    def shared_variance(self) -> float:
        """That of the discrepancy between visits at one phase."""
        return self.discrepancy_share * self.discrepancy.speed_fraction**2

    def own_variance(self, predicted: Sequence[PredictedSpeeds]) -> FloatArray:
        """Return the variances of each log speed about predictions, but for what is shared; (n, q).

        They are one for all, (1, q), without errors in timing; NaN where a simulation failed.
        """
        if not self.discrepancy.timing_cycle:
            predicted = [PredictedSpeeds(*np.zeros((2, 1, each.log_speed.shape[1]))) for each in predicted]
        both = zip(predicted, self.recordings, strict=True)
        return np.hstack([log_speed_sd(each, of.relative_se, self.discrepancy) for each, of in both]) ** 2

    def points(self, phi: FloatArray) -> FloatArray:
        """Return the part (n, V k) of psi (n, V d) that simulations take."""
        return np.hstack([self.of_one.heart(part) for part in np.split(phi, self.coupling.visits, axis=1)])

    def completed(self, points: FloatArray, scores: FloatArray) -> FloatArray:
        """Return psi (n, V d) of points (n, V k) and scores (n, V o)."""
        parts = zip(*(np.split(each, self.coupling.visits, axis=1) for each in (points, scores)), strict=True)
        return np.hstack([completed_heart(heart, own, self.of_one) for heart, own in parts])

    def simulated(self, points: FloatArray) -> tuple[Walls, FloatArray]:
        """Return the walls of the hearts of all visits; nothing else is told by a beat."""
        phi = self.coupling.phi(self.completed(points, np.zeros((len(points), self.width))))
        walls = tuple(model.wall(each) for model, each in zip(self.models, phi, strict=True))
        return walls, np.zeros(len(points))

    def log_likelihood_of(self, points: FloatArray, simulated: Walls, scores: FloatArray) -> FloatArray:
        """Return log p(all recordings | points, scores), -inf where a simulation failed; shape (n,)."""
        return self.log_density_about(self.predicted(self.completed(points, scores), simulated))

    def predicted(self, psi: FloatArray, walls: Sequence[WallPhases]) -> list[PredictedSpeeds]:
        """Return the noiseless log speeds of psi (n, V d) whose walls are given, by visit."""
        phi = self.coupling.phi(psi)
        return [model.predict_at(*each) for model, *each in zip(self.models, phi, walls, strict=True)]

    def log_density_about(self, predicted: Sequence[PredictedSpeeds]) -> FloatArray:
        """Return log p(all recordings | psi) of predicted speeds, by visit; -inf where one is NaN; (n,)."""
        distance = np.hstack(
            [
                np.log(recording.speed_m_s) - each.log_speed
                for recording, each in zip(self.recordings, predicted, strict=True)
            ]
        )
        density = np.full(len(distance), -np.inf)
        known = np.flatnonzero(np.isfinite(distance).all(axis=1))
        variance, diagonal = self.own_variance(predicted), np.eye(distance.shape[1])
        for start in range(0, len(known), ROWS_AT_ONCE):
            rows = known[start : start + ROWS_AT_ONCE]
            own = variance if len(variance) == 1 else variance[rows]
            covariance = self.shared + own[:, :, None] * diagonal
            density[rows] = _log_normal(distance[rows], np.asarray(np.linalg.cholesky(covariance)))
        return density

    def linear(self, simulated: Walls, scores: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return log speeds of all visits less their predictions (n, q), and slopes of these (n, q, V o)."""
        mixing = self.coupling.of(self.of_one.operator, self.of_one.names).factors
        own = np.einsum("jvw,nwj->nvj", mixing, scores.reshape(len(scores), self.coupling.visits, -1))
        of_visit = [
            linear_speeds(model, wall, own[:, visit])
            for visit, (model, wall) in enumerate(zip(self.models, simulated, strict=True))
        ]
        slopes = [
            np.einsum("jw,npj->npwj", mixing[:, visit], slope).reshape(*slope.shape[:2], -1)
            for visit, (_, slope) in enumerate(of_visit)
        ]
        return np.hstack([distance for distance, _ in of_visit]), np.hstack(slopes)

    def errors(self, points: FloatArray, simulated: Walls, scores: FloatArray) -> Errors:
        """Return the errors of the log speeds of all visits at these scores.

        Their shared part W W^T has that of the discrepancy also within a visit, so own errors are the less.
        """
        phase = np.concatenate(self.phase_index)
        sd = np.sqrt(self.discrepancy_share) * self.discrepancy.speed_fraction
        between = sd * (phase[:, None] == np.unique(phase))
        shared = np.hstack([block_diag(*(each.shared for each in self.recordings)), between])
        predicted = self.predicted(self.completed(points, scores), simulated)
        own = np.sqrt(self.own_variance(predicted) - self.shared_variance)
        return Errors(np.where(np.isfinite(own), own, 1.0), shared)

    def error_covariance(self) -> FloatArray:
        """Return the covariance of all log speeds without errors in timing; (q, q)."""
        own = np.concatenate([recording.relative_se for recording in self.recordings])
        return np.asarray(self.shared + np.diag(own**2 + self.discrepancy.speed_fraction**2))


def _log_normal(distance: FloatArray, factor: FloatArray) -> FloatArray:
    """Return the normal log densities of rows (n, q) by the Cholesky factors (n or 1, q, q)."""
    z = (
        np.linalg.solve(factor[0], distance.T).T
        if len(factor) == 1
        else np.linalg.solve(factor, distance[:, :, None])[:, :, 0]
    )
    log_root = np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1)
    constant = 0.5 * distance.shape[1] * np.log(2.0 * np.pi)
    return np.asarray(-0.5 * (z**2).sum(axis=1) - log_root - constant)


def visits_model(
    models: Sequence[SpeedModel],
    phase_index: Sequence[IntArray],
    shares: FloatArray,
    discrepancy_share: float,
) -> VisitsModel:
    """Build the model of a person's visits, at least two, which must have the same settings.

    ``phase_index`` has the numbers of each visit's measured phases in the protocol; shares are (d,), below 1.
    """
    if any(model.settings != models[0].settings for model in models):
        raise ValueError("visits of one person have different models; infer both by one experiment")
    coupling = Coupling(models[0].settings.prior, shares, len(models))
    return VisitsModel(tuple(models), tuple(phase_index), coupling, discrepancy_share)
