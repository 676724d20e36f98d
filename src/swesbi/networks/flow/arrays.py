"""The flow's net as arrays, evaluated under one condition at a time, in single precision.

An inference asks for thousands of draws and densities under the same conditioning vector. What the embedding
and the first layer of each transform make of it is worked out once. The inverse of a masked autoregressive
transform goes coordinate by coordinate: the parameters of one depend on those before it (Papamakarios,
Pavlakou and Murray 2017, Sec. 3). Units stand in the order in which the coordinates need them, so that each
pass is a product with a block of a triangular matrix, and every unit is evaluated once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import BoolArray, FloatArray, IntArray

SingleArray = NDArray[np.float32]
BLOCK: Final = 512  # points side by side: their hidden units stay in the processor's cache
SLOPE_LIMIT: Final = np.float32(np.log(1e-3))  # of zuko.transforms.MonotonicAffineTransform
PARAMETERS: Final = 2  # of an affine map: shift, and logarithm of the scale


@dataclass(frozen=True)
class Layer:
    """An affine layer: weight (outputs, inputs) and bias (outputs,)."""

    weight: SingleArray
    bias: SingleArray

    def __call__(self, values: SingleArray) -> SingleArray:
        """Return what it makes of values (inputs,); shape (outputs,)."""
        return self.weight @ values + self.bias


@dataclass(frozen=True)
class MaskedTransform:
    """One affine autoregressive transform; C' numbers of the condition, zero where a weight is masked.

    Attributes:
        order: Pass in which the inverse finds each coordinate; shape (d,).
        layers: The net of rectified linear units that gives shift and log scale of each coordinate in turn;
            the first takes the d coordinates, then the condition.
    """

    order: IntArray
    layers: tuple[Layer, ...]

    @cached_property
    def passes(self) -> _Passes:
        """The same net with its units in the order of the passes."""
        return _in_order_of_passes(self)


@dataclass(frozen=True)
class FlowArrays:
    """A flow of d coordinates under C conditions.

    Attributes:
        embedding: Layers between which the SiLU stands; none where the condition is taken as it is.
        transforms: From the coordinates to the base space, the first first.
    """

    embedding: tuple[Layer, ...]
    transforms: tuple[MaskedTransform, ...]

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
        passes = [transform.passes for transform in self.transforms]
        return ConditionedFlow(
            tuple((part, (part.of_condition @ embedded + part.bias)[:, None]) for part in passes)
        )


@dataclass(frozen=True)
class ConditionedFlow:
    """A flow under one condition: its transforms, and what their first layers make of the condition."""

    transforms: tuple[tuple[_Passes, SingleArray], ...]

    def to_base(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return where points (n, d) lie in the base space, (n, d), and log |du / dx|, (n,)."""
        found, log_slope = np.empty(points.shape), np.zeros(len(points))
        with np.errstate(over="ignore", invalid="ignore"):  # far from all that it was trained on
            for rows in _blocks(len(points)):
                x = _columns(points[rows])
                for passes, given in self.transforms:
                    x, of_transform = passes.forward(x, given)
                    log_slope[rows] += of_transform
                found[rows] = x.T
        return found, log_slope

    def from_base(self, points: FloatArray) -> FloatArray:
        """Return the points (n, d) that lie at these of the base space, (n, d)."""
        found = np.empty(points.shape)
        with np.errstate(over="ignore", invalid="ignore"):
            for rows in _blocks(len(points)):
                y = _columns(points[rows])
                for passes, given in reversed(self.transforms):
                    y = passes.inverse(y, given)
                found[rows] = y.T
        return found


@dataclass(frozen=True)
class _Passes:
    """A transform whose coordinates and hidden units stand in the order of the inverse's passes.

    Attributes:
        coordinate: Coordinate that each pass finds; shape (d,).
        of_known: Weights of the first hidden layer on the coordinates, in this order; shape (h, d).
        of_condition: Its weights on the condition; shape (h, C').
        bias: Its biases; shape (h,).
        hidden: The further hidden layers, biases as columns.
        output: Shift and log scale of each coordinate, in this order, bias as a column.
        ends: Of each hidden layer, how many units the passes so far need; shape (d,) each.
    """

    coordinate: IntArray
    of_known: SingleArray
    of_condition: SingleArray
    bias: SingleArray
    hidden: tuple[Layer, ...]
    output: Layer
    ends: tuple[IntArray, ...]

    def forward(self, x: SingleArray, given: SingleArray) -> tuple[SingleArray, SingleArray]:
        """Return y (d, n) and log |dy / dx| (n,) of x (d, n)."""
        known = x[self.coordinate]
        values = np.maximum(self.of_known @ known + given, 0.0)
        for layer in self.hidden:
            values = np.maximum(layer.weight @ values + layer.bias, 0.0)
        parameters = self.output.weight @ values + self.output.bias
        log_scale = _log_scale(parameters[1::PARAMETERS])
        y = np.empty_like(x)
        y[self.coordinate] = known * np.exp(log_scale) + parameters[::PARAMETERS]
        return y, log_scale.sum(axis=0)

    def inverse(self, y: SingleArray, given: SingleArray) -> SingleArray:
        """Return x (d, n) of y (d, n)."""
        wanted, known = y[self.coordinate], np.empty_like(y)
        values = [np.empty((ends[-1], y.shape[1]), np.float32) for ends in self.ends]
        for number in range(len(y)):
            self._evaluate(number, known, given, values)
            reached, rows = self.ends[-1][number], slice(PARAMETERS * number, PARAMETERS * (number + 1))
            shift, scale = self.output.weight[rows, :reached] @ values[-1][:reached] + self.output.bias[rows]
            known[number] = (wanted[number] - shift) * np.exp(-_log_scale(scale))
        x = np.empty_like(y)
        x[self.coordinate] = known
        return x

    def _evaluate(
        self, number: int, known: SingleArray, given: SingleArray, values: Sequence[SingleArray]
    ) -> None:
        """Fill in the hidden units that a pass is the first to need."""
        new = [slice(ends[number - 1] if number else 0, ends[number]) for ends in self.ends]
        first = self.of_known[new[0], :number] @ known[:number] + given[new[0]]
        values[0][new[0]] = np.maximum(first, 0.0)
        for layer, units, below, end, rows in zip(
            self.hidden, values[1:], values, self.ends, new[1:], strict=False
        ):
            reached = end[number]
            units[rows] = np.maximum(layer.weight[rows, :reached] @ below[:reached] + layer.bias[rows], 0.0)


def _log_scale(raw: SingleArray) -> SingleArray:
    """Return log scales that stay above log(1e-3) in size (zuko.transforms.MonotonicAffineTransform)."""
    return np.asarray(raw / (1.0 + np.abs(raw / SLOPE_LIMIT)))


def _blocks(count: int) -> list[slice]:
    return [slice(start, start + BLOCK) for start in range(0, count, BLOCK)]


def _columns(points: FloatArray) -> SingleArray:
    return np.ascontiguousarray(points.T, dtype=np.float32)


def _in_order_of_passes(transform: MaskedTransform) -> _Passes:
    coordinate = np.argsort(transform.order, kind="stable")
    d, layers = len(coordinate), transform.layers
    outputs = (PARAMETERS * coordinate[:, None] + np.arange(PARAMETERS)).ravel()
    firsts = _first_needed(layers, outputs, d)
    units = [np.argsort(first, kind="stable")[: int((first < d).sum())] for first in firsts]
    ends = tuple(
        np.searchsorted(first[rows], np.arange(d), side="right")
        for first, rows in zip(firsts, units, strict=True)
    )
    first, *others = layers
    between = list(zip(others, units, [*units[1:], outputs], strict=True))
    ordered = [
        Layer(np.ascontiguousarray(layer.weight[np.ix_(above, below)]), layer.bias[above][:, None])
        for layer, below, above in between
    ]
    weight = first.weight[units[0]]
    return _Passes(
        coordinate=coordinate,
        of_known=np.ascontiguousarray(weight[:, coordinate]),
        of_condition=np.ascontiguousarray(weight[:, d:]),
        bias=first.bias[units[0]],
        hidden=tuple(ordered[:-1]),
        output=ordered[-1],
        ends=ends,
    )


def _first_needed(layers: Sequence[Layer], outputs: IntArray, d: int) -> list[IntArray]:
    """Return the pass that first needs each unit of each hidden layer, d where none does."""
    connected: list[BoolArray] = [layer.weight != 0.0 for layer in layers]
    above = np.empty(len(outputs), dtype=np.int64)
    above[outputs] = np.repeat(np.arange(d), PARAMETERS)
    firsts: list[IntArray] = []
    for mask in reversed(connected[1:]):
        above = np.where(mask, above[:, None], d).min(axis=0)
        firsts.append(above)
    return firsts[::-1]
