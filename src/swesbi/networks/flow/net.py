"""The net that a flow q(heart | z) is trained as, and the arrays that it leaves."""

from __future__ import annotations

import numpy as np
import torch
import zuko
from torch import Tensor
from zuko.distributions import NormalizingFlow
from zuko.flows.autoregressive import MaskedAutoregressiveTransform
from zuko.nn import MLP, Linear, MaskedLinear

from swesbi.networks.affine_maf import Layer, SingleArray
from swesbi.networks.flow.arrays import FlowArrays, MaskedTransform
from swesbi.networks.settings import FlowSettings


class ConditionalFlow(zuko.flows.Flow):  # type: ignore[misc]  # zuko is not typed
    """A flow whose conditioning vector passes an embedding net, trained with it, which all transforms share.

    The masks of an autoregressive net leave few units to each coordinate; what a recording says is worked out
    before them. The vector itself goes along, so that an embedding only has to add to it.
    """

    def __init__(self, flow: zuko.flows.Flow, embedding: torch.nn.Module | None) -> None:
        super().__init__(flow.transform, flow.base)
        self.embedding = embedding

    def embed(self, condition: Tensor) -> Tensor:
        """Return what the transforms take of conditions (n, C); shape (n, C + outputs)."""
        if self.embedding is None:
            return condition
        return torch.cat((condition, self.embedding(condition)), dim=-1)

    def forward(self, c: Tensor) -> NormalizingFlow:
        """Return the densities under conditions c (n, C)."""
        return super().forward(self.embed(c))


def build_net(settings: FlowSettings, parameters: int, components: int) -> ConditionalFlow:
    """Build an untrained flow of so many parameters, conditioned on ``components`` numbers."""
    embedding, outputs = None, 0
    if settings.embedding is not None:
        outputs = settings.embedding.outputs
        hidden = (settings.embedding.hidden_features,) * settings.embedding.hidden_layers
        embedding = MLP(components, outputs, hidden, activation=torch.nn.SiLU)
    shape = {
        "features": parameters,
        "context": components + outputs,
        "transforms": settings.transforms,
        "hidden_features": (settings.hidden_features,) * settings.hidden_layers,
    }
    return ConditionalFlow(zuko.flows.MAF(**shape), embedding)


def arrays_of(net: ConditionalFlow) -> FlowArrays:
    """Return the net as arrays, copies of its weights."""
    embedding = () if net.embedding is None else net.embedding.children()
    return FlowArrays(
        embedding=tuple(_layer(part, part.weight) for part in embedding if isinstance(part, Linear)),
        transforms=tuple(_masked(transform) for transform in net.transform.transforms),
    )


def _masked(transform: MaskedAutoregressiveTransform) -> MaskedTransform:
    layers = (layer for layer in transform.hyper if isinstance(layer, MaskedLinear))
    order = transform.order.numpy().astype(np.int64)
    return MaskedTransform(order, tuple(_layer(layer, layer.mask * layer.weight) for layer in layers))


def _layer(layer: Linear | MaskedLinear, weight: Tensor) -> Layer:
    return Layer(_single(weight), _single(layer.bias))


def _single(values: Tensor) -> SingleArray:
    return np.array(values.detach().numpy(), dtype=np.float32)
