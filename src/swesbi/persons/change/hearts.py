"""The likelihood of the hearts of a person's visits: what measures them is integrated out of both together.

The parameters of the measurement at all visits are tied as the visits are, so their scores are those of psi
(``visits``), zeta: at visit v the scores are sum_w L_vw zeta_w.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.measurement.likelihood import log_speed_sd
from swesbi.measurement.shared_error import Errors
from swesbi.measurement.speeds import WallPhases
from swesbi.persons.change.likelihood import shared_factor
from swesbi.persons.change.visits import Coupling, VisitsModel
from swesbi.persons.cohort.model import PriorAlone
from swesbi.posterior.hearts import completed_heart, linear_speeds
from swesbi.posterior.marginal import Marginal
from swesbi.prior import JointPriorSettings, OperatorPrior, SimulatedPrior, SomeParameters

Walls = tuple[WallPhases, ...]


@dataclass(frozen=True)
class VisitsHearts(Marginal[Walls]):
    """Prior and likelihood of the hearts of V visits, in the coordinates of psi; V k parameters."""

    visits: VisitsModel

    @property
    def prior(self) -> SomeParameters:
        """The prior of psi, V d parameters."""
        return self.visits.coupling.joint

    @property
    def settings(self) -> PriorAlone:
        """Hold the prior of the hearts."""
        return PriorAlone(self.coupling.joint)

    @property
    def width(self) -> int:
        """Number of parameters of the measurements of all visits."""
        return len(self._of_one.operator.parameters) * self.number

    @property
    def number(self) -> int:
        """V."""
        return self.visits.coupling.visits

    @cached_property
    def coupling(self) -> Coupling:
        """How the hearts of the visits follow from their part of psi."""
        return self._coupling_of(self._of_one.simulated)

    def points(self, phi: FloatArray) -> FloatArray:
        """Return the part (n, V k) of psi (n, V d) that simulations take."""
        return np.hstack([self._of_one.heart(part) for part in np.split(phi, self.number, axis=1)])

    def completed(self, points: FloatArray, scores: FloatArray) -> FloatArray:
        """Return psi (n, V d) of points (n, V k) and scores (n, V o)."""
        parts = zip(*(np.split(each, self.number, axis=1) for each in (points, scores)), strict=True)
        return np.hstack([completed_heart(heart, own, self._of_one) for heart, own in parts])

    def simulated(self, points: FloatArray) -> tuple[Walls, FloatArray]:
        """Return the walls of the hearts of all visits; nothing else is told by a beat."""
        phi = self.visits.phi(self.completed(points, np.zeros((len(points), self.width))))
        walls = tuple(model.wall(each) for model, each in zip(self.visits.models, phi, strict=True))
        return walls, np.zeros(len(points))

    def log_likelihood_of(self, points: FloatArray, simulated: Walls, scores: FloatArray) -> FloatArray:
        """Return log p(all recordings | points, scores), -inf where a simulation failed; shape (n,)."""
        phi = self.visits.phi(self.completed(points, scores))
        return self.visits.log_likelihood_of(self.visits.predict_at(phi, simulated))

    def linear(self, simulated: Walls, scores: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return log speeds of all visits less their predictions (n, q), and slopes of these (n, q, V o)."""
        own = np.einsum("jvw,nwj->nvj", self._mixing, scores.reshape(len(scores), self.number, -1))
        of_visit = [
            linear_speeds(model, wall, own[:, visit])
            for visit, (model, wall) in enumerate(zip(self.visits.models, simulated, strict=True))
        ]
        slopes = [
            np.einsum("jw,npj->npwj", self._mixing[:, visit], slope).reshape(*slope.shape[:2], -1)
            for visit, (_, slope) in enumerate(of_visit)
        ]
        return np.hstack([distance for distance, _ in of_visit]), np.hstack(slopes)

    def errors(self, points: FloatArray, simulated: Walls, scores: FloatArray) -> Errors:
        """Return the errors of the log speeds of all visits at these scores."""
        phi = self.visits.phi(self.completed(points, scores))
        predicted = self.visits.predict_at(phi, simulated)
        recordings = [model.recording for model in self.visits.models]
        discrepancy = self.visits.models[0].settings.discrepancy
        shared = shared_factor(
            recordings, self.visits.phase_index, discrepancy, self.visits.discrepancy_share
        )
        between = self.visits.discrepancy_share * discrepancy.speed_fraction**2
        sd = np.hstack(
            [
                np.sqrt(log_speed_sd(each, recording.relative_se, discrepancy) ** 2 - between)
                for each, recording in zip(predicted, recordings, strict=True)
            ]
        )
        return Errors(np.where(np.isfinite(sd), sd, 1.0), shared)

    @property
    def _of_one(self) -> JointPriorSettings:
        return self.visits.models[0].settings.prior

    @cached_property
    def _mixing(self) -> FloatArray:
        """Factors L of the parameters of the measurement; shape (o, V, V)."""
        return self._coupling_of(self._of_one.operator).factors

    def _coupling_of(self, part: SimulatedPrior | OperatorPrior) -> Coupling:
        shares = dict(zip(self._of_one.names, self.visits.coupling.shares, strict=True))
        return Coupling(part, np.array([shares[name] for name in part.names]), self.number)
