"""The trained flow at one recording as a proposal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.flow.net import TrainedFlow, draw_phi, log_q
from swesbi.speed_model.recording import SpeedRecording

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class FlowProposal:
    """q(phi | z) of a trained flow for one conditioning vector z of shape (C,)."""

    flow: TrainedFlow
    condition: FloatArray

    def draw(self, draws: int, seed: int) -> FloatArray:
        """Draw phi ~ q; shape (draws, 4)."""
        phi: FloatArray = draw_phi(self.flow, self.condition[None], draws, seed)[0]
        return phi

    def log_density(self, phi: FloatArray) -> FloatArray:
        """Return log q(phi | z) of phi (n, 4); shape (n,)."""
        return log_q(self.flow, self.condition, phi)


def flow_proposal(flow: TrainedFlow, recording: SpeedRecording) -> FlowProposal:
    """Return the flow's posterior of a recording as a proposal."""
    return FlowProposal(flow, flow.conditioner.condition(recording))
