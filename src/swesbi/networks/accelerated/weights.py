"""The weights of sbi's masked autoregressive flow in four blocks of one vector, and back.

One vector means one optimiser step, one norm and one mask for all layers. A layer of the vector holds
[W | b], so that its bias is one more column that an input of ones multiplies.

The flow permutes its features after each transform. Here every transform takes the features in their first
order: the permutations go into the columns and rows of the first and last layers.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import torch
from nflows.transforms import MaskedAffineAutoregressiveTransform, PointwiseAffineTransform, RandomPermutation
from nflows.transforms.made import MADE
from sbi.neural_nets.estimators import ConditionalDensityEstimator
from torch import Tensor, nn


@dataclass(frozen=True)
class Blocks:
    """Views of one vector: the layers of T transforms with K blocks of H units, D features, C components.

    Attributes:
        vector: Everything, shape (n,).
        context: [W | b] of the conditioning vector's layers, shape (T, H, C + 1).
        first: Of the features' layers, shape (T, H, D + 1).
        hidden: Of the layers between, shape (T, K, H, H + 1).
        last: Of the outputs, shape (T, 2 D, H + 1): D unconstrained scales, then D shifts.
    """

    vector: Tensor
    context: Tensor
    first: Tensor
    hidden: Tensor
    last: Tensor

    def like(self) -> Blocks:
        """Return blocks of the same shapes that hold zeros."""
        shapes = [tuple(block.shape) for block in (self.context, self.first, self.hidden, self.last)]
        return _blocks(shapes, torch.zeros_like(self.vector))


@dataclass(frozen=True)
class _PlacedLayer:
    """A layer of the flow and where it lies in the blocks: a row of the layer is ``rows`` of its place."""

    linear: nn.Linear
    place: Tensor
    rows: Tensor
    columns: Tensor

    @property
    def mask(self) -> Tensor:
        """One where the weight counts, shape of the weight."""
        mask: Tensor = getattr(self.linear, "mask", torch.ones_like(self.linear.weight))
        return mask

    def put(self, weight: Tensor, bias: Tensor) -> None:
        self.place[self.rows[:, None], self.columns] = weight
        self.place[self.rows, -1] = bias

    def take(self) -> tuple[Tensor, Tensor]:
        return self.place[self.rows[:, None], self.columns], self.place[self.rows, -1]


class FlowWeights:
    """The weights of a flow, in blocks; the flow's own stay as they are until ``write``."""

    def __init__(self, flow: ConditionalDensityEstimator) -> None:
        """Read the weights of an estimator that sbi built with ``model="maf"``.

        Raises:
            TypeError: The estimator is made of other parts.
        """
        transforms = _check_parts(flow)
        mades = [
            transform.autoregressive_net
            for transform in transforms
            if isinstance(transform, MaskedAffineAutoregressiveTransform)
        ]
        shapes = _shapes(mades)
        size = sum(torch.Size(shape).numel() for shape in shapes)
        vector = mades[0].final_layer.weight.new_zeros(size)
        self.blocks = _blocks(shapes, vector)
        self.mask = self.blocks.like()
        self._layers = list(_layers(self.blocks, transforms))
        with torch.no_grad():
            for layer in self._layers:
                layer.put(layer.linear.weight * layer.mask, layer.linear.bias)
            for layer in _layers(self.mask, transforms):
                layer.put(layer.mask, torch.ones_like(layer.linear.bias))

    def write(self) -> None:
        """Give the flow these weights; its masked ones, which never count, keep their values."""
        with torch.no_grad():
            for layer in self._layers:
                weight, bias = layer.take()
                layer.linear.weight.copy_(torch.where(layer.mask > 0, weight, layer.linear.weight))
                layer.linear.bias.copy_(bias)


def standardise(flow: ConditionalDensityEstimator, theta: Tensor, z: Tensor) -> tuple[Tensor, Tensor, float]:
    """Return theta (N, 3) and z (N, C) as the flow standardises them, z with a column of ones.

    The third is the log-determinant of theta's standardisation, by which log q is larger.
    """
    z = flow.net._embedding_net(z)
    z = torch.cat([z, z.new_ones(len(z), 1)], dim=1)
    first = flow.net._transform._transforms[0]
    if not isinstance(first, PointwiseAffineTransform):
        return theta, z, 0.0
    theta, log_determinant = first(theta)
    return theta, z, float(log_determinant[0])


def _check_parts(flow: ConditionalDensityEstimator) -> list[nn.Module]:
    parts = list(flow.net._transform._transforms)
    first = 1 if isinstance(parts[0], PointwiseAffineTransform) else 0
    for index, part in enumerate(parts[first:]):
        expected = RandomPermutation if index % 2 else MaskedAffineAutoregressiveTransform
        if not isinstance(part, expected):
            raise TypeError(f"transform {index} is a {type(part).__name__}, expected {expected.__name__}")
    return parts[first:]


def _shapes(mades: list[MADE]) -> list[tuple[int, ...]]:
    transforms, blocks = len(mades), len(mades[0].blocks)
    units, features = mades[0].initial_layer.weight.shape
    components = mades[0].context_layer.weight.shape[1]
    return [
        (transforms, units, components + 1),
        (transforms, units, features + 1),
        (transforms, blocks, units, units + 1),
        (transforms, 2 * features, units + 1),
    ]


def _blocks(shapes: list[tuple[int, ...]], vector: Tensor) -> Blocks:
    parts = torch.split(vector, [torch.Size(shape).numel() for shape in shapes])
    views = [part.view(shape) for part, shape in zip(parts, shapes, strict=True)]
    return Blocks(vector, *views)


def _layers(blocks: Blocks, transforms: list[nn.Module]) -> Iterator[_PlacedLayer]:
    """Yield every layer with its place; ``order`` is where the features of a transform come from."""
    order = torch.arange(blocks.first.shape[2] - 1, device=blocks.vector.device)
    index = 0
    for transform in transforms:
        if isinstance(transform, RandomPermutation):
            order = order[transform._permutation]
        else:
            yield from _transform_layers(blocks, index, transform.autoregressive_net, order)
            index += 1


def _transform_layers(blocks: Blocks, index: int, made: MADE, order: Tensor) -> Iterator[_PlacedLayer]:
    units = torch.arange(blocks.first.shape[1], device=order.device)
    components = torch.arange(blocks.context.shape[2] - 1, device=order.device)
    yield _PlacedLayer(made.context_layer, blocks.context[index], units, components)
    yield _PlacedLayer(made.initial_layer, blocks.first[index], units, order)
    for block, place in zip(made.blocks, blocks.hidden[index], strict=True):
        yield _PlacedLayer(block.linear, place, units, units)
    # The flow's outputs alternate: scale and shift of its first feature, of its second, ...
    scale_and_shift = torch.stack([order, order + len(order)], dim=1).flatten()
    yield _PlacedLayer(made.final_layer, blocks.last[index], scale_and_shift, units)
