"""The weights of sbi's masked autoregressive flow in four blocks of one vector, back, and as arrays.

One vector means one optimiser step, one norm and one mask for all layers. A layer of the vector holds
[W | b], so that its bias is one more column that an input of ones multiplies.

The flow permutes its features after each transform. Here every transform takes the features in their first
order: the permutations go into the columns and rows of the first and last layers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from nflows.transforms import PointwiseAffineTransform
from nflows.transforms.made import MADE
from sbi.neural_nets.estimators import ConditionalDensityEstimator
from sbi.utils.sbiutils import Standardize
from torch import Tensor, nn

from swesbi.networks.paper.estimator import SbiFlow


@dataclass(frozen=True)
class Blocks:
    """Views of one vector: the layers of T transforms with K blocks of H units, D features, C components."""

    vector: Tensor
    context: Tensor  # [W | b] of the conditioning vector's layers, (T, H, C + 1)
    first: Tensor  # of the features' layers, (T, H, D + 1)
    hidden: Tensor  # of the layers between, (T, K, H, H + 1)
    last: Tensor  # of the outputs, (T, 2 D, H + 1): D unconstrained scales, then D shifts

    def like(self) -> Blocks:
        """Return blocks of the same shapes that hold zeros."""
        shapes = [block.shape for block in (self.context, self.first, self.hidden, self.last)]
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


class FlowWeights:
    """The weights of an estimator that sbi built with ``model="maf"``; its own stay until ``write``."""

    def __init__(self, flow: ConditionalDensityEstimator) -> None:
        transforms = list(flow.net._transform._transforms)
        if isinstance(transforms[0], PointwiseAffineTransform):
            del transforms[0]
        # An autoregressive transform and a permutation in turn.
        mades: list[MADE] = [one.autoregressive_net for one in transforms[::2]]
        shapes = _shapes(mades)
        size = sum(map(math.prod, shapes))
        self.blocks = _blocks(shapes, mades[0].final_layer.weight.new_zeros(size))
        self.mask = self.blocks.like()
        self.orders = [torch.arange(mades[0].initial_layer.weight.shape[1], device=self.mask.vector.device)]
        """Where the features of each transform come from, and at last those of the base space."""
        for one in transforms[1::2]:
            self.orders.append(self.orders[-1][one._permutation])
        self._layers = list(_layers(self.blocks, mades, self.orders))
        with torch.no_grad():
            for layer in self._layers:
                layer.put(layer.linear.weight * layer.mask, layer.linear.bias)
            for layer in _layers(self.mask, mades, self.orders):
                layer.put(layer.mask, torch.ones_like(layer.linear.bias))

    def write(self) -> None:
        """Give the flow these weights; its masked ones, which never count, keep their values."""
        with torch.no_grad():
            for layer in self._layers:
                weight = layer.place[layer.rows[:, None], layer.columns]
                layer.linear.weight.copy_(torch.where(layer.mask > 0, weight, layer.linear.weight))
                layer.linear.bias.copy_(layer.place[layer.rows, -1])


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


def arrays_of(flow: ConditionalDensityEstimator) -> SbiFlow:
    """Return the flow as arrays, copies of its weights."""
    weights = FlowWeights(flow)
    blocks, orders = weights.blocks, np.stack([order.cpu().numpy() for order in weights.orders])
    parameters, components = len(orders[0]), blocks.context.shape[2] - 1
    theta_mean, theta_scale = np.zeros(parameters), np.ones(parameters)
    first = flow.net._transform._transforms[0]
    if isinstance(first, PointwiseAffineTransform):  # x * scale + shift
        theta_scale = 1.0 / first._scale.cpu().double().numpy()
        theta_mean = -first._shift.cpu().double().numpy() * theta_scale
    z_mean, z_scale = np.zeros(components), np.ones(components)
    for part in flow.net._embedding_net.modules():
        if isinstance(part, Standardize):
            z_mean, z_scale = (values.cpu().double().numpy() for values in (part._mean, part._std))
    return SbiFlow(
        context=blocks.context.cpu().numpy(),
        first=blocks.first.cpu().numpy(),
        hidden=blocks.hidden.cpu().numpy(),
        last=blocks.last.cpu().numpy(),
        order=np.argsort(orders[:-1]),
        base=orders[-1],
        theta_mean=theta_mean,
        theta_scale=theta_scale,
        z_mean=z_mean,
        z_scale=z_scale,
    )


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


def _blocks(shapes: Sequence[tuple[int, ...]], vector: Tensor) -> Blocks:
    parts = torch.split(vector, [math.prod(shape) for shape in shapes])
    return Blocks(vector, *(part.view(shape) for part, shape in zip(parts, shapes, strict=True)))


def _layers(blocks: Blocks, mades: list[MADE], orders: list[Tensor]) -> Iterator[_PlacedLayer]:
    """Yield every layer with its place."""
    units = torch.arange(blocks.first.shape[1], device=blocks.vector.device)
    components = torch.arange(blocks.context.shape[2] - 1, device=blocks.vector.device)
    for index, (made, order) in enumerate(zip(mades, orders, strict=False)):
        yield _PlacedLayer(made.context_layer, blocks.context[index], units, components)
        yield _PlacedLayer(made.initial_layer, blocks.first[index], units, order)
        for block, place in zip(made.blocks, blocks.hidden[index], strict=True):
            yield _PlacedLayer(block.linear, place, units, units)
        # The flow's outputs alternate: scale and shift of its first feature, of its second, ...
        scale_and_shift = torch.stack([order, order + len(order)], dim=1).flatten()
        yield _PlacedLayer(made.final_layer, blocks.last[index], scale_and_shift, units)
