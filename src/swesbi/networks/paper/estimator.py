"""The trained density estimator q(theta | z) as arrays, after one epoch of its training or several."""

from __future__ import annotations

from collections.abc import Mapping
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
from swesbi.parameters import THETA_COLUMNS, THETA_NAMES

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
class TrainedEstimator(artefacts.Artefact, kind="estimator"):
    """The density estimator after one epoch of its training."""

    net: Annotated[SbiFlow, artefacts.Part()]
    components: Annotated[tuple[str, ...], artefacts.Labels("component")]
    epoch: Annotated[int, artefacts.Variable("", "1", "epoch after which the weights are these, from 1")]
    validation_loss: Annotated[float, artefacts.Variable("", "1", "mean of -log q over held-out rows")]
    best: Annotated[bool, artefacts.Variable("", "1", "1 where no epoch of the training has a lower loss")]

    labels = LABELS


SCHEMA: Final = artefacts.schema_of(TrainedEstimator, along="checkpoint")["/"]


@dataclass(frozen=True)
class Checkpoints(artefacts.Artefact, kind="checkpoints"):
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
