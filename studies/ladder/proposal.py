"""A network's posterior as a first proposal under another structure, whose prior may have moved."""

from __future__ import annotations

from dataclasses import dataclass

from swesbi.base.arrays import FloatArray
from swesbi.networks.flow.flow import FlowProposal
from swesbi.posterior.space import PlacedProposal
from swesbi.prior import SimulatedPrior, from_logit, log_jacobian, to_logit


@dataclass(frozen=True)
class MovedProposal:
    """A flow's proposal carried from the box of its own prior to that of another, logit by logit.

    Where a prior has moved by a factor, its bounds with it, every parameter moves by that factor. The flow's
    base space is kept.
    """

    flow: FlowProposal
    home: SimulatedPrior
    prior: SimulatedPrior

    def draw(self, draws: int, seed: int) -> FloatArray:
        """Draw hearts; shape (draws, k)."""
        return self._there(self.flow.draw(draws, seed))

    def log_density(self, phi: FloatArray) -> FloatArray:
        """Return log q(phi), per unit of phi, of phi (n, d); shape (n,)."""
        return self.log_density_at(*self.place(phi))

    def log_density_at(self, u: FloatArray, log_slope: FloatArray) -> FloatArray:
        """Return log q of points that lie at u (n, d) of the base space, as ``place`` gives both; (n,)."""
        return self.flow.log_density_at(u, log_slope)

    def place(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return phi (n, d) in the flow's base space, u (n, d), with log |du / dphi| of shape (n,)."""
        back, log_slope = self._back(phi)
        u, of_flow = self.flow.place(back)
        return u, of_flow + log_slope

    def at(self, u: FloatArray) -> FloatArray:
        """Return the phi (n, d) of points u (n, d) of that space."""
        return self._there(self.flow.at(u))

    def _there(self, phi: FloatArray) -> FloatArray:
        return from_logit(to_logit(phi, self.home), self.prior)

    def _back(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        eta = to_logit(phi, self.prior)
        return from_logit(eta, self.home), log_jacobian(eta, self.home) - log_jacobian(eta, self.prior)


def first_proposal(flow: FlowProposal, prior: SimulatedPrior) -> PlacedProposal:
    """Return the flow's posterior as a proposal under a prior that has the same parameters.

    Raises:
        ValueError: The flow infers other parameters.
    """
    home = flow.flow.prior
    if home.names != prior.names:
        raise ValueError(
            f"the network infers {', '.join(home.names)}, the structure {', '.join(prior.names)}: a "
            "structure may move what is free, but not free or fix it; correct its `changes`, or train anew"
        )
    return flow if home.parameters == prior.parameters else MovedProposal(flow, home, prior)
