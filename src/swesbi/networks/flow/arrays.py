"""The flow's net as arrays: an embedding of the condition, and masked transforms of the coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.networks.affine_maf import ZUKO, ConditionedFlow, Layer, Passes, SingleArray, in_order_of_passes


@dataclass(frozen=True)
class MaskedTransform:
    """One affine autoregressive transform of d coordinates; masked weights are zero."""

    order: IntArray
    """Pass in which the inverse finds each coordinate; shape (d,)."""
    layers: tuple[Layer, ...]
    """The net that gives shift and raw scale of each coordinate in turn; the first layer takes the
    coordinates, then the embedded condition."""

    @cached_property
    def passes(self) -> Passes:
        """The same net with its units in the order of the passes."""
        return in_order_of_passes(self.order, self.layers, ZUKO)

    @cached_property
    def of_condition(self) -> Layer:
        """What the first hidden units, in that order, take of the embedded condition."""
        first, units = self.layers[0], self.passes.units
        return Layer(np.ascontiguousarray(first.weight[units, len(self.order) :]), first.bias[units])


@dataclass(frozen=True)
class FlowArrays:
    """A flow of d coordinates under C conditions."""

    embedding: tuple[Layer, ...]
    """Layers between which the SiLU stands; none where the condition is taken as it is."""
    transforms: tuple[MaskedTransform, ...]
    """From the coordinates to the base space, the first first."""

    def embed(self, condition: FloatArray) -> SingleArray:
        """Return what the transforms take of a condition (C,): itself, then what the embedding adds."""
        given: SingleArray = condition.astype(np.float32)
        values = given
        for number, layer in enumerate(self.embedding):
            values = layer(values)
            if number < len(self.embedding) - 1:
                values = np.asarray(values / (1.0 + np.exp(-values)))
        return np.concatenate([given, values]) if self.embedding else given

    def under(self, condition: FloatArray) -> ConditionedFlow:
        """Return the flow under one condition (C,)."""
        embedded = self.embed(condition)
        return ConditionedFlow(
            tuple((one.passes, one.of_condition(embedded)[:, None]) for one in self.transforms)
        )
