"""sbi's masked autoregressive flow, rebuilt from its weights, and draws from it.

A network is trained once and drawn from by many short jobs, of which importing sbi would take a third.
sbi makes this flow of parts of nflows (``posterior_nn(model="maf")``); here the same parts are put together
under the same names, so that its weights fit.

nflows inverts a transform by one evaluation of its whole network for every parameter, of which it keeps
the one that has just become known. A hidden unit depends on the parameters up to its degree (Germain et
al. 2015, MADE), so it is evaluated here in the pass in which these are known: the same sums of the same
terms, hence the same draws.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
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
from nflows.transforms.made import MADE, MaskedLinear
from torch import Tensor, nn

from swesbi.base.arrays import FloatArray
from swesbi.networks.determinism import reproducible
from swesbi.networks.settings import EstimatorSettings
from swesbi.prior import PriorSettings, in_bounds

ROWS_PER_BATCH = 10_000
"""Bounds the memory; fixed, because the random numbers of a batch depend on its size."""


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
        standardise = [] if settings.z_score_x == "none" else [_Standardise(components)]
        embedding = nn.Sequential(*standardise, nn.Identity())
        self.net = Flow(transform, StandardNormal((parameters,)), embedding)
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


def for_drawing(net: MaskedFlow) -> MaskedFlow:
    """Return a copy of a flow that makes the same draws in less time.

    Transforms other than masked affine ones with plain blocks stay as they are.
    """
    fast = copy.deepcopy(net).eval()
    for module in list(fast.modules()):
        for name, child in module.named_children():
            if isinstance(child, MaskedAffineAutoregressiveTransform) and _is_plain(child):
                setattr(module, name, SequentialInverse(child))
    return fast


class SequentialInverse(nn.Module):
    """A masked affine autoregressive transform whose inverse evaluates every hidden unit once."""

    def __init__(self, transform: MaskedAffineAutoregressiveTransform) -> None:
        super().__init__()
        self._transform = transform
        made = transform.autoregressive_net
        hidden = [made.initial_layer, *(block.linear for block in made.blocks)]
        self._passes = [[_units(layer, units) for layer in hidden] for units in _units_by_pass(transform)]
        self._last = _units(made.final_layer, slice(None))

    def forward(self, inputs: Tensor, context: Tensor) -> tuple[Tensor, Tensor]:
        """Return the transform of theta (n, d) and the logarithm of its determinant; shape (n,)."""
        mapped: tuple[Tensor, Tensor] = self._transform(inputs, context)
        return mapped

    def inverse(self, inputs: Tensor, context: Tensor) -> tuple[Tensor, Tensor]:
        """Return theta (n, d) of base draws (n, d), and the logarithm of the determinant; shape (n,)."""
        made = self._transform.autoregressive_net
        added = made.activation(made.context_layer(context))
        hidden = [torch.zeros_like(added) for _ in self._passes[0]]
        outputs, log_determinant = self._transform._elementwise_inverse(inputs, self._last(hidden[-1]))
        for layers in self._passes:
            values = outputs
            for number, (layer, known) in enumerate(zip(layers, hidden, strict=True)):
                sums = layer(values)
                sums = sums + added[:, layer.units] if number == 0 else sums
                known[:, layer.units] = made.activation(sums)
                values = known
            outputs, log_determinant = self._transform._elementwise_inverse(inputs, self._last(values))
        return outputs, log_determinant


@dataclass(frozen=True)
class _Units:
    """Units of a layer, with their weights and biases."""

    units: slice
    weight: Tensor
    bias: Tensor

    def __call__(self, values: Tensor) -> Tensor:
        return nn.functional.linear(values, self.weight, self.bias)


def _units(layer: MaskedLinear, units: slice) -> _Units:
    weight, bias = (layer.weight * layer.mask).detach(), layer.bias.detach()
    return _Units(units, weight[units].contiguous(), bias[units].contiguous())


def _units_by_pass(transform: MaskedAffineAutoregressiveTransform) -> list[slice]:
    """Return the hidden units of degree 1, 2, ..., which become known one pass after another."""
    step = transform.features - 1
    return [slice(first, None, step) for first in range(step)]


def _is_plain(transform: MaskedAffineAutoregressiveTransform) -> bool:
    """Tell whether units are activated sums of masked terms and no more, their degrees in turn."""
    made: MADE = transform.autoregressive_net
    if made.use_residual_blocks or not hasattr(made, "context_layer") or transform.features < 2:
        return False
    layers = [made.initial_layer, *(block.linear for block in made.blocks)]
    return all(block.batch_norm is None for block in made.blocks) and all(
        bool((layer.degrees[units] == number).all())
        for layer in layers
        for number, units in enumerate(_units_by_pass(transform), start=1)
    )


class Sampler(Protocol):
    """A density estimator that can be sampled: the trained one, or a checkpoint of its training."""

    @property
    def net(self) -> MaskedFlow:
        """The density estimator."""

    @property
    def components(self) -> tuple[str, ...]:
        """The names of its C inputs."""


def draw_candidates(estimator: Sampler, z: FloatArray, draws: int, seed: int) -> FloatArray:
    """Draw theta ~ q(theta | z) for each conditioning vector, inside the prior's bounds or not.

    sbi's own sampler rejects draws outside the prior until it has enough, which need never happen;
    here time and memory are bounded by ``draws``.

    Args:
        estimator: The density estimator.
        z: (B, C) standardised conditioning vectors.
        draws: Number of draws for each.
        seed: Seed of the draws.

    Returns:
        Array of shape (B, draws, 3).

    Raises:
        ValueError: z has another number of components than the estimator.
    """
    if z.ndim != 2 or z.shape[1] != len(estimator.components):
        raise ValueError(f"z has shape {z.shape}, the estimator takes {len(estimator.components)} components")
    condition, net = torch.from_numpy(z.astype(np.float32)), for_drawing(estimator.net)
    with reproducible(seed), torch.no_grad():
        sampled = [np.concatenate(list(_batches(net, row[None], draws))) for row in condition]
    return np.stack(sampled)


def draw_until(
    estimator: Sampler, z: FloatArray, enough: int, at_most: int, prior: PriorSettings, seed: int
) -> FloatArray:
    """Draw candidates for one conditioning vector until ``enough`` lie within the prior's bounds.

    The candidates are the first of those that ``draw_candidates`` gives for ``at_most`` draws under the
    same seed, so a criterion of so many in-prior draws has the same outcome, sooner.

    Args:
        estimator: The density estimator.
        z: (C,) standardised conditioning vector.
        enough: In-prior draws after which drawing stops.
        at_most: Candidates after which it stops in any case.
        prior: The prior whose bounds count.
        seed: Seed of the draws.

    Returns:
        Array of shape (n, 3), in whole batches of ``ROWS_PER_BATCH``, n <= at_most.
    """
    condition, net = torch.from_numpy(z[None].astype(np.float32)), for_drawing(estimator.net)
    drawn: list[FloatArray] = []
    inside = 0
    with reproducible(seed), torch.no_grad():
        for batch in _batches(net, condition, at_most):
            drawn.append(batch)
            inside += int(in_bounds(batch, prior).sum())
            if inside >= enough:
                break
    return np.concatenate(drawn)


def losses(estimator: Sampler, theta: FloatArray, z: FloatArray) -> FloatArray:
    """Return -log q(theta | z) of each row, as training counts it; theta (N, 3), z (N, C), result (N,)."""
    rows = [torch.from_numpy(values.astype(np.float32)) for values in (theta, z)]
    with reproducible(0), torch.no_grad():
        density: FloatArray = estimator.net.log_prob(*rows).numpy().astype(np.float64)
    return -density


def _batches(net: MaskedFlow, row: torch.Tensor, draws: int) -> Iterator[FloatArray]:
    sizes = [ROWS_PER_BATCH] * (draws // ROWS_PER_BATCH) + [draws % ROWS_PER_BATCH]
    for size in sizes:
        if size:
            yield net.sample(size, row).numpy().astype(np.float64)
