"""Draws of sbi's masked autoregressive flow, each hidden unit evaluated once.

nflows inverts a transform by one evaluation of its whole network for every parameter, of which it keeps
the one that has just become known. A hidden unit depends on the parameters up to its degree (Germain et
al. 2015, MADE), so it is evaluated here in the pass in which these are known: the same sums of the same
terms, hence the same draws.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass

import torch
from nflows.transforms import MaskedAffineAutoregressiveTransform
from nflows.transforms.made import MADE, MaskedLinear
from torch import Tensor, nn

from swesbi.inference.maf import MaskedFlow


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
