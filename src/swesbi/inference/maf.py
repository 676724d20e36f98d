"""The masked autoregressive flow that sbi trains, rebuilt from its weights.

A network is trained once and drawn from by many short jobs, of which importing sbi would take a third.
sbi makes this flow of parts of nflows (``posterior_nn(model="maf")``); here the same parts are put together
under the same names, so that its weights fit.
"""

from __future__ import annotations

from collections.abc import Mapping

import torch
from nflows.distributions import StandardNormal
from nflows.flows import Flow
from nflows.transforms import (
    CompositeTransform,
    MaskedAffineAutoregressiveTransform,
    PointwiseAffineTransform,
    RandomPermutation,
    Transform,
)
from torch import Tensor, nn

from swesbi.inference.determinism import reproducible
from swesbi.inference.settings import EstimatorSettings


class MaskedFlow(nn.Module):
    """q(theta | z) on the CPU, with the weights of an estimator of sbi."""

    def __init__(
        self, settings: EstimatorSettings, parameters: int, components: int, state: Mapping[str, Tensor]
    ) -> None:
        """Build the flow and give it its weights.

        Args:
            settings: Its architecture.
            parameters: Number D of parameters.
            components: Number C of components of the conditioning vector.
            state: The state_dict of sbi's estimator, or of another flow like this.

        Raises:
            RuntimeError: Names or shapes of the weights are not the flow's.
        """
        super().__init__()
        with reproducible(0):  # permutations are drawn, before the state's take their place
            transform = CompositeTransform(_transforms(settings, parameters, components))
        self.net = Flow(transform, StandardNormal((parameters,)), _standardisation(settings, components))
        self.load_state_dict(dict(state))
        self.eval()

    def sample(self, draws: int, z: Tensor) -> Tensor:
        """Draw theta for one conditioning vector, (1, C); shape (draws, D)."""
        sampled: Tensor = self.net.sample(draws, context=z)
        return sampled[0]

    def log_prob(self, theta: Tensor, z: Tensor) -> Tensor:
        """Return log q(theta | z) of each row; theta (N, D), z (N, C), result (N,)."""
        density: Tensor = self.net.log_prob(theta, context=z)
        return density


class _Standardise(nn.Module):
    """(z - mean) / sd, component by component."""

    def __init__(self, components: int) -> None:
        super().__init__()
        self.register_buffer("_mean", torch.zeros(components))
        self.register_buffer("_std", torch.ones(components))

    def forward(self, z: Tensor) -> Tensor:
        """Standardise z (N, C)."""
        return (z - self.get_buffer("_mean")) / self.get_buffer("_std")


def _transforms(settings: EstimatorSettings, parameters: int, components: int) -> list[Transform]:
    parts: list[Transform] = []
    if settings.z_score_theta == "independent":
        parts.append(PointwiseAffineTransform(torch.zeros(parameters), torch.ones(parameters)))
    for _ in range(settings.transforms):
        transform = MaskedAffineAutoregressiveTransform(
            features=parameters,
            hidden_features=settings.hidden_features,
            context_features=components,
            num_blocks=settings.blocks,
            use_residual_blocks=False,
            activation=torch.tanh,
        )
        parts += [transform, RandomPermutation(features=parameters)]
    return parts


def _standardisation(settings: EstimatorSettings, components: int) -> nn.Module:
    if settings.z_score_x == "none":
        return nn.Identity()
    return nn.Sequential(_Standardise(components), nn.Identity())
