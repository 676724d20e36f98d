"""The trained density estimator q(theta | z) as arrays, after one epoch or several: files, draws, losses.

The points of the base space are those that sbi would draw.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Final

import numpy as np

from swesbi import artefacts
from swesbi.artefacts.schema import Schema
from swesbi.base.arrays import FloatArray, IntArray
from swesbi.networks.affine_maf import (
    NFLOWS,
    ConditionedFlow,
    Layer,
    Passes,
    SingleArray,
    in_order_of_passes,
    log_normal,
)
from swesbi.networks.files import NetworkFile
from swesbi.networks.training import reproducible
from swesbi.parameters import THETA_COLUMNS, THETA_NAMES
from swesbi.prior import PriorSettings, in_bounds

LABELS: Final = {"parameter": list(THETA_NAMES)}


@dataclass(frozen=True)
class SbiFlow:
    """sbi's masked autoregressive flow; every transform takes the parameters in their first order.

    Weights have the biases as their last columns; masked ones are zero.
    """

    context: Annotated[
        SingleArray, artefacts.Variable("transform unit component_and_bias", "1", "weights on z")
    ]
    first: Annotated[
        SingleArray, artefacts.Variable("transform unit parameter_and_bias", "1", "weights on theta")
    ]
    hidden: Annotated[
        SingleArray, artefacts.Variable("transform layer unit unit_and_bias", "1", "of the layers between")
    ]
    last: Annotated[
        SingleArray,
        artefacts.Variable(
            "transform output unit_and_bias", "1", "raw scales of all parameters, then shifts"
        ),
    ]
    order: Annotated[
        IntArray, artefacts.Variable("transform parameter", "1", "pass in which the inverse finds each")
    ]
    base: Annotated[
        IntArray, artefacts.Variable("base_parameter", "1", "parameter of each coordinate of the base space")
    ]
    theta_mean: Annotated[FloatArray, artefacts.Variable("parameter", THETA_COLUMNS, "of training rows")]
    theta_scale: Annotated[
        FloatArray, artefacts.Variable("parameter", THETA_COLUMNS, "standard deviation of training rows")
    ]
    z_mean: Annotated[FloatArray, artefacts.Variable("component", "1", "of training rows")]
    z_scale: Annotated[
        FloatArray, artefacts.Variable("component", "1", "standard deviation of training rows")
    ]

    def __post_init__(self) -> None:
        """Refuse arrays that do not make up one net."""
        transforms, units, parameters = len(self.order), self.first.shape[-2], len(THETA_NAMES)
        shapes = {
            "context": (transforms, units, len(self.z_mean) + 1),
            "first": (transforms, units, parameters + 1),
            "hidden": (transforms, self.hidden.shape[-3], units, units + 1),
            "last": (transforms, 2 * parameters, units + 1),
            "order": (transforms, parameters),
            "base": (parameters,),
            "theta_mean": (parameters,),
            "theta_scale": (parameters,),
            "z_scale": self.z_mean.shape,
        }
        for name, shape in shapes.items():
            if (found := getattr(self, name).shape) != shape:
                raise ValueError(f"{name!r} has the shape {found}, its net takes {shape}")
        for name, orders in (("order", self.order), ("base", self.base[None])):
            if (np.sort(orders, axis=1) != np.arange(parameters)).any():
                raise ValueError(f"{name!r} does not name each of {parameters} parameters once")

    def log_prob(self, theta: FloatArray, z: FloatArray) -> FloatArray:
        """Return log q(theta | z) of each row, shape (N,); theta (N, D), z (N, C)."""
        standardised = (theta - self.theta_mean) / self.theta_scale
        placed = [self.under(each).to_base(row[None]) for row, each in zip(standardised, z, strict=True)]
        u, log_slope = (np.concatenate(parts) for parts in zip(*placed, strict=True))
        return np.asarray(log_slope + log_normal(u) - np.log(self.theta_scale).sum())

    def at(self, u: FloatArray, z: FloatArray) -> FloatArray:
        """Return the theta (n, D) of points u (n, D) of the base space under one z (C,)."""
        points = np.empty(u.shape)
        points[:, self.base] = u
        return self.under(z).from_base(points) * self.theta_scale + self.theta_mean

    def under(self, z: FloatArray) -> ConditionedFlow:
        """Return the flow of standardised theta under one z (C,)."""
        inputs = ((z - self.z_mean) / self.z_scale).astype(np.float32)
        added = np.tanh(self.context[..., :-1] @ inputs + self.context[..., -1]) + self.first[..., -1]
        return ConditionedFlow(
            tuple(
                (passes, sums[passes.units, None]) for passes, sums in zip(self._passes, added, strict=True)
            )
        )

    @cached_property
    def _passes(self) -> tuple[Passes, ...]:
        parameters = len(self.theta_mean)
        shift_and_scale = np.arange(2 * parameters).reshape(2, -1)[::-1].T.ravel()
        weights = zip(self.first, self.hidden, self.last[:, shift_and_scale], strict=True)
        return tuple(
            in_order_of_passes(
                order, [Layer(one[:, :-1], one[:, -1]) for one in (first, *between, last)], NFLOWS
            )
            for order, (first, between, last) in zip(self.order, weights, strict=True)
        )


@dataclass(frozen=True)
class TrainedEstimator(NetworkFile, kind="estimator"):
    """The density estimator after one epoch of its training."""

    net: Annotated[SbiFlow, artefacts.Part()]
    components: Annotated[tuple[str, ...], artefacts.Labels("component")]
    epoch: Annotated[int, artefacts.Variable("", "1", "epoch after which the weights are these, from 1")]
    validation_loss: Annotated[float, artefacts.Variable("", "1", "mean of -log q over held-out rows")]
    best: Annotated[bool, artefacts.Variable("", "1", "1 where no epoch of the training has a lower loss")]

    labels = LABELS


SCHEMA: Final = artefacts.schema_of(TrainedEstimator, along="checkpoint")["/"]


@dataclass(frozen=True)
class Checkpoints(NetworkFile, kind="checkpoints"):
    """The density estimator after several epochs of one training, the best and the last among them."""

    of_epochs: tuple[TrainedEstimator, ...]

    @property
    def best(self) -> TrainedEstimator:
        """That of the lowest validation loss."""
        return next(one for one in self.of_epochs if one.best)

    @classmethod
    def schema(cls) -> Schema:
        """Return the one group of the file."""
        return {"/": SCHEMA}

    @classmethod
    def required_labels(cls) -> tuple[artefacts.Labels, ...]:
        """Return the names of parameters and components."""
        return TrainedEstimator.required_labels()

    def to_groups(self) -> dict[str, artefacts.Group]:
        """Return the content of the file."""
        values = artefacts.stacked_values(self.of_epochs)["/"]
        labels = {**LABELS, "component": list(self.best.components)}
        return {"/": artefacts.build_group(SCHEMA, values, labels)}

    @classmethod
    def rebuilt(cls, groups: Mapping[str, artefacts.Group], made: artefacts.Provenance) -> Checkpoints:
        """Return what the group of a file holds."""
        return cls(tuple(artefacts.from_rows(TrainedEstimator, groups["/"], "checkpoint")))


ROWS_PER_BATCH: Final = 10_000
"""Bounds the memory; fixed, because the random numbers of a batch depend on its size."""


def draw_candidates(estimator: TrainedEstimator, z: FloatArray, draws: int, seed: int) -> FloatArray:
    """Draw theta ~ q(theta | z) for each z (B, C), inside the prior's bounds or not; (B, draws, 3).

    sbi's own sampler rejects draws outside the prior until it has enough, which need never happen.
    """
    if z.ndim != 2 or z.shape[1] != len(estimator.components):
        raise ValueError(f"z has shape {z.shape}, the estimator takes {len(estimator.components)} components")
    with reproducible(seed):
        return np.stack([np.concatenate(list(_batches(estimator, row, draws))) for row in z])


def draw_until(
    estimator: TrainedEstimator, z: FloatArray, enough: int, at_most: int, prior: PriorSettings, seed: int
) -> FloatArray:
    """Draw candidates for one z (C,) in whole batches until ``enough`` lie within the prior's bounds; (n, 3).

    They are the first of those that ``draw_candidates`` gives for ``at_most`` draws under the same seed, so a
    criterion of so many in-prior draws has the same outcome, sooner.
    """
    drawn: list[FloatArray] = []
    inside = 0
    with reproducible(seed):
        for batch in _batches(estimator, z, at_most):
            drawn.append(batch)
            inside += int(in_bounds(batch, prior).sum())
            if inside >= enough:
                break
    return np.concatenate(drawn)


def losses(estimator: TrainedEstimator, theta: FloatArray, z: FloatArray) -> FloatArray:
    """Return -log q(theta | z) of each row, as training counts it; theta (N, 3), z (N, C), result (N,)."""
    return -estimator.net.log_prob(theta, z)


def _batches(estimator: TrainedEstimator, z: FloatArray, draws: int) -> Iterator[FloatArray]:
    import torch  # here alone: who reads a network's file need not wait for it

    for start in range(0, draws, ROWS_PER_BATCH):
        base = torch.randn(min(ROWS_PER_BATCH, draws - start), len(estimator.net.base))
        yield estimator.net.at(base.numpy(), z)
