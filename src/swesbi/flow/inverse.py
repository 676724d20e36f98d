"""Draws of an autoregressive flow, each part of its networks evaluated once.

The inverse of a masked autoregressive transform goes coordinate by coordinate: the parameters of one depend
on those before it (Papamakarios, Pavlakou and Murray 2017, Sec. 3). zuko evaluates the whole network and
every coordinate's transform in each of these passes and keeps one. Here a pass evaluates the units that its
coordinate needs and no earlier pass has: the same sums of the same terms, hence the same draws.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch
import torch.nn.functional as F
import zuko
from torch import Tensor
from zuko.flows.autoregressive import MaskedAutoregressiveTransform
from zuko.nn import MaskedLinear
from zuko.utils import unpack


@dataclass(frozen=True)
class _Units:
    """Units of one layer that a pass evaluates: their rows in the layer, weights and biases."""

    rows: Tensor
    weight: Tensor
    bias: Tensor


@dataclass(frozen=True)
class _Pass:
    """One pass: the coordinates that it finds, and the units it evaluates, layer by layer."""

    coordinates: Tensor
    layers: tuple[_Units, ...]


@dataclass(frozen=True)
class InverseTransform:
    """The inverse of one transform, x from y; ``widths`` are the numbers of hidden units."""

    transform: MaskedAutoregressiveTransform
    passes: tuple[_Pass, ...]
    widths: tuple[int, ...]

    def __call__(self, y: Tensor, condition: Tensor) -> Tensor:
        """Return x (n, d) for y (n, d) under conditions (n, C)."""
        known = torch.cat((torch.zeros_like(y), condition), dim=1)
        hidden = [torch.zeros(len(y), width) for width in self.widths]
        for one in self.passes:
            parameters = _evaluate(one.layers, known, hidden)
            parts = unpack(parameters.view(len(y), -1, self.transform.total), self.transform.shapes)
            univariate: Any = self.transform.univariate(*parts)
            known[:, one.coordinates] = univariate.inv(y[:, one.coordinates])
        return known[:, : y.shape[1]]


def inverse_transforms(net: zuko.flows.Flow) -> tuple[InverseTransform, ...]:
    """Return the inverses of a flow's transforms, in the order in which they make draws of its base.

    They hold copies of the weights: a network that learns on needs new ones.

    Raises:
        ValueError: A transform is no masked autoregressive one with rectified linear units.
    """
    return tuple(_inverse(transform) for transform in reversed(net.transform.transforms))


def _evaluate(layers: Sequence[_Units], known: Tensor, hidden: Sequence[Tensor]) -> Tensor:
    """Fill in the hidden units of a pass and return the parameters that it finds."""
    values = known
    for units, layer in zip(layers[:-1], hidden, strict=True):
        layer[:, units.rows] = F.relu(F.linear(values, units.weight, units.bias))
        values = layer
    return F.linear(values, layers[-1].weight, layers[-1].bias)


def _inverse(transform: torch.nn.Module) -> InverseTransform:
    if not isinstance(transform, MaskedAutoregressiveTransform) or transform.order is None:
        raise ValueError(f"draws are made by masked autoregressive transforms; found {transform}")
    layers = [layer for layer in transform.hyper if isinstance(layer, MaskedLinear)]
    between = [layer for layer in transform.hyper if not isinstance(layer, MaskedLinear)]
    if not all(isinstance(layer, torch.nn.ReLU) for layer in between):
        raise ValueError(f"draws are made with rectified linear units; found {between}")
    done = [torch.zeros(layer.out_features, dtype=torch.bool) for layer in layers]
    passes = []
    for number in range(transform.passes):
        coordinates = torch.nonzero(transform.order == number).squeeze(1)
        outputs = torch.zeros(layers[-1].out_features, dtype=torch.bool)
        outputs.view(-1, transform.total)[coordinates] = True
        passes.append(_Pass(coordinates, _new_units(layers, outputs, done)))
    return InverseTransform(transform, tuple(passes), tuple(layer.out_features for layer in layers[:-1]))


def _new_units(layers: Sequence[MaskedLinear], outputs: Tensor, done: Sequence[Tensor]) -> tuple[_Units, ...]:
    """Return the units that these outputs depend on and that are not in ``done``, where they are added."""
    needed, found = outputs, []
    for layer, before in zip(reversed(layers), reversed(done), strict=True):
        rows = torch.nonzero(needed & ~before).squeeze(1)
        before |= needed
        weight = (layer.mask * layer.weight).detach()
        found.append(_Units(rows, weight[rows], layer.bias.detach()[rows]))
        needed = layer.mask[needed].any(dim=0)
    return tuple(reversed(found))
