"""The density q(heart | z) of a trained flow, its draws, and the base space in which it is standard normal.

A heart is theta with the free physiology, all that a simulation takes. What else a recording depends on
needs no simulation and is integrated out (``posterior.hearts``), so that no network has to learn it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.measurement.speeds import SpeedRecording
from swesbi.networks.affine_maf import ConditionedFlow, log_normal
from swesbi.networks.flow.cells import CellConditioner
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.prior import from_logit, log_jacobian, to_logit

FARTHEST: Final = -30.0  # in the logit: the lower bound of every parameter


@dataclass(frozen=True)
class FlowProposal:
    """q(heart | z) of a trained flow for one conditioning vector z of shape (C,)."""

    flow: TrainedFlow
    condition: FloatArray

    def __post_init__(self) -> None:
        components = len(self.flow.components)
        if self.condition.shape != (components,):
            raise ValueError(f"z has shape {self.condition.shape}, the flow takes {components} components")
        if not np.isfinite(self.condition).all():
            raise ValueError("z holds values that are not finite; check the recording that it comes from")

    def draw(self, draws: int, seed: int) -> FloatArray:
        """Draw hearts ~ q, always inside the prior's box; shape (draws, k)."""
        rng = np.random.default_rng(seed)
        return self.at(rng.standard_normal((draws, len(self.flow.prior.parameters))))

    def log_density(self, heart: FloatArray) -> FloatArray:
        """Return log q(heart | z), per unit of it, of hearts (n, k); -inf where the map overflows; (n,)."""
        return self.log_density_at(*self.place(heart))

    def log_density_at(self, u: FloatArray, log_slope: FloatArray) -> FloatArray:
        """Return log q of hearts that lie at u (n, k) of the base space, as ``place`` gives both; (n,)."""
        log_q = log_slope + log_normal(u)
        return np.where(np.isfinite(log_q), log_q, -np.inf)

    def place(self, heart: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return hearts (n, k) in the flow's base space, u (n, k), with log |du / dheart| of shape (n,)."""
        flow, eta = self.flow, to_logit(heart, self.flow.prior)
        u, log_slope = self._net.to_base(flow.eta.apply(eta))
        return u, log_slope - np.log(flow.eta.scale).sum() - log_jacobian(eta, flow.prior)

    def at(self, u: FloatArray) -> FloatArray:
        """Return the hearts (n, k) of points u (n, k) of that space.

        A point so far out that the flow's map overflows, as it may under a condition that is unlike all that
        it was trained on, goes to a corner of the box, where no posterior has any mass.
        """
        eta = self._net.from_base(u) * self.flow.eta.scale + self.flow.eta.mean
        eta[~np.isfinite(eta).all(axis=-1)] = FARTHEST
        return from_logit(eta, self.flow.prior)

    @cached_property
    def _net(self) -> ConditionedFlow:
        return self.flow.net.under(self.condition)


def flow_proposal(flow: TrainedFlow, recording: SpeedRecording) -> FlowProposal:
    """Return the flow's posterior of a recording as a proposal.

    A recording of pushes is refused by a flow that was trained on recordings of known phases.
    """
    if recording.cell is not None and not isinstance(flow.conditioner, CellConditioner):
        raise ValueError("this network knows the phases of its own subjects alone; use one over a population")
    return FlowProposal(flow, flow.conditioner.condition(recording))
