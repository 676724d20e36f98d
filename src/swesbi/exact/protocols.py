"""What the exact posterior needs of a model of a recording and of a proposal."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from swesbi.prior import JointPriorSettings

FloatArray = NDArray[np.float64]


class HasPrior(Protocol):
    """Settings that hold the joint prior."""

    @property
    def prior(self) -> JointPriorSettings:
        """The prior of phi."""


class LikelihoodModel(Protocol):
    """The model of one recording: its prior and its likelihood, exact and cheap enough to be evaluated."""

    @property
    def settings(self) -> HasPrior:
        """Hold the prior."""

    def log_likelihood(self, phi: FloatArray) -> FloatArray:
        """Return log p(data | phi) of phi (n, 4), -inf where the simulation failed; shape (n,)."""


class Proposal(Protocol):
    """A density over phi, within the prior's box, that can be drawn from."""

    def draw(self, draws: int, seed: int) -> FloatArray:
        """Draw phi; shape (draws, 4)."""

    def log_density(self, phi: FloatArray) -> FloatArray:
        """Return log q(phi), per unit of phi, of phi (n, 4); shape (n,)."""
