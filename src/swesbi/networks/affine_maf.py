"""A masked autoregressive flow of affine maps as arrays, evaluated in single precision.

Both networks are evaluated here: those that zuko trains on speeds, and sbi's, whose transforms are of nflows.
Thousands of draws and densities are asked for under the same condition, so what the first layers make of it
is worked out once. The inverse of a transform goes coordinate by coordinate: the map of one depends on those
before it (Papamakarios, Pavlakou and Murray 2017, Sec. 3). Units stand in the order in which the coordinates
need them, so that each pass is a product with a block of a triangular matrix, each unit evaluated once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import BoolArray, FloatArray, IntArray

SingleArray = NDArray[np.float32]
BLOCK: Final = 512  # points side by side: their hidden units stay in the processor's cache
PARAMETERS: Final = 2  # of an affine map: shift, and what the scale is made of
SLOPE_LIMIT: Final = np.float32(np.log(1e-3))  # of zuko.transforms.MonotonicAffineTransform
SCALE_FLOOR: Final = np.float32(1e-3)  # of nflows.transforms.MaskedAffineAutoregressiveTransform


@dataclass(frozen=True)
class Law:
    """What a library makes of the sums of its layers: hidden units, and logarithms of scales."""

    unit: Callable[[SingleArray], SingleArray]
    log_scale: Callable[[SingleArray], SingleArray]


def _rectified(sums: SingleArray) -> SingleArray:
    return np.maximum(sums, 0.0)


def _bounded(raw: SingleArray) -> SingleArray:
    return np.asarray(raw / (1.0 + np.abs(raw / SLOPE_LIMIT)))


def _log_of_softplus(raw: SingleArray) -> SingleArray:
    return np.asarray(np.log(np.logaddexp(raw, np.float32(0.0)) + SCALE_FLOOR))


ZUKO: Final = Law(_rectified, _bounded)
NFLOWS: Final = Law(np.tanh, _log_of_softplus)


@dataclass(frozen=True)
class Layer:
    """An affine layer: weight (outputs, inputs) and bias (outputs,)."""

    weight: SingleArray
    bias: SingleArray

    def __call__(self, values: SingleArray) -> SingleArray:
        """Return what it makes of values (inputs,); shape (outputs,)."""
        return self.weight @ values + self.bias


@dataclass(frozen=True)
class Passes:
    """A transform whose d coordinates and h hidden units stand in the order of the inverse's passes."""

    law: Law
    coordinate: IntArray
    """Coordinate that each pass finds; shape (d,)."""
    units: IntArray
    """Places of the first layer's units in the transform as it was given; shape (h,)."""
    of_known: SingleArray
    """Weights of these units on the coordinates; shape (h, d)."""
    hidden: tuple[Layer, ...]
    """The further hidden layers, biases as columns."""
    output: Layer
    """Shift and raw scale of each coordinate in turn, bias as a column."""
    ends: tuple[IntArray, ...]
    """Of each hidden layer, how many units the passes so far need; shape (d,) each."""

    def forward(self, x: SingleArray, given: SingleArray) -> tuple[SingleArray, SingleArray]:
        """Return y (d, n) and log |dy / dx| (n,) of x (d, n); ``given`` (h, 1) is of the condition."""
        known = x[self.coordinate]
        values = self.law.unit(self.of_known @ known + given)
        for layer in self.hidden:
            values = self.law.unit(layer.weight @ values + layer.bias)
        parameters = self.output.weight @ values + self.output.bias
        log_scale = self.law.log_scale(parameters[1::PARAMETERS])
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
            known[number] = (wanted[number] - shift) * np.exp(-self.law.log_scale(scale))
        x = np.empty_like(y)
        x[self.coordinate] = known
        return x

    def _evaluate(
        self, number: int, known: SingleArray, given: SingleArray, values: Sequence[SingleArray]
    ) -> None:
        """Fill in the hidden units that a pass is the first to need."""
        new = [slice(ends[number - 1] if number else 0, ends[number]) for ends in self.ends]
        values[0][new[0]] = self.law.unit(self.of_known[new[0], :number] @ known[:number] + given[new[0]])
        for layer, units, below, end, rows in zip(
            self.hidden, values[1:], values, self.ends, new[1:], strict=False
        ):
            reached = end[number]
            units[rows] = self.law.unit(layer.weight[rows, :reached] @ below[:reached] + layer.bias[rows])


@dataclass(frozen=True)
class ConditionedFlow:
    """A flow under one condition: its transforms, the first first, and what each adds of it, (h, 1)."""

    transforms: tuple[tuple[Passes, SingleArray], ...]

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


def _blocks(count: int) -> list[slice]:
    return [slice(start, start + BLOCK) for start in range(0, count, BLOCK)]


def _columns(points: FloatArray) -> SingleArray:
    return np.ascontiguousarray(points.T, dtype=np.float32)


def log_normal(u: FloatArray) -> FloatArray:
    """Return log N(u; 0, I), the log density of the base space, at points u (n, d); shape (n,)."""
    return np.asarray(-0.5 * (u**2 + np.log(2.0 * np.pi)).sum(axis=1))


def in_order_of_passes(order: IntArray, layers: Sequence[Layer], law: Law) -> Passes:
    """Return a transform with its units in the order of the passes.

    ``order`` (d,) is the pass in which the inverse finds each coordinate. The first layer takes the
    coordinates before all else, the last gives shift and raw scale of each in turn. Masked weights are zero.
    """
    coordinate = np.argsort(order, kind="stable")
    d = len(coordinate)
    outputs = (PARAMETERS * coordinate[:, None] + np.arange(PARAMETERS)).ravel()
    firsts = _first_needed(layers, outputs, d)
    units = [np.argsort(first, kind="stable")[: int((first < d).sum())] for first in firsts]
    between = zip(layers[1:], units, [*units[1:], outputs], strict=True)
    ordered = [
        Layer(np.ascontiguousarray(layer.weight[np.ix_(above, below)]), layer.bias[above][:, None])
        for layer, below, above in between
    ]
    return Passes(
        law=law,
        coordinate=coordinate,
        units=units[0],
        of_known=np.ascontiguousarray(layers[0].weight[np.ix_(units[0], coordinate)]),
        hidden=tuple(ordered[:-1]),
        output=ordered[-1],
        ends=tuple(
            np.searchsorted(first[rows], np.arange(d), side="right")
            for first, rows in zip(firsts, units, strict=True)
        ),
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
