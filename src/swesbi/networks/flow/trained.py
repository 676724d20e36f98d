"""A trained flow q(heart | z): its net as arrays, its file, and its posterior of a recording.

A heart is theta with the free physiology, all that a simulation takes. What else a recording depends on
needs no simulation and is integrated out (``posterior.hearts``), so that no network has to learn it. In the
flow's base space the density is standard normal.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from swesbi.artefacts import Group, Labels, Provenance, Variable, build_group
from swesbi.artefacts.schema import Schema
from swesbi.base.arrays import FloatArray, IntArray
from swesbi.base.settings import Settings
from swesbi.measurement.speeds import SpeedRecording
from swesbi.networks.affine_maf import (
    PARAMETERS,
    ZUKO,
    ConditionedFlow,
    Layer,
    Passes,
    SingleArray,
    in_order_of_passes,
    log_normal,
)
from swesbi.networks.files import NetworkFile, Standardisation
from swesbi.networks.flow.conditioning import (
    AnyConditioner,
    CellConditioner,
    CellSettings,
    Conditioner,
    ConditioningSettings,
)
from swesbi.networks.settings import FlowSettings
from swesbi.prior import SimulatedPrior, from_logit, log_jacobian, to_logit


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


CONDITIONERS: Final[Mapping[str, tuple[type[Any], type[Settings]]]] = {
    "features": (Conditioner, ConditioningSettings),
    "cells": (CellConditioner, CellSettings),
}
"""What the network sees of a recording, as files name it: class, and that of its settings."""
SCHEMA: Final = {
    "weight": Variable("weight_number", "1", "embedding, then each transform: of each layer weights, biases"),
    "input_mean": Variable("component", "1", "mean of the network's inputs over the training rows"),
    "input_scale": Variable("component", "1", "standard deviation of the inputs over the training rows"),
    "eta_mean": Variable("heart_parameter", "1", "mean of the logit of hearts over the training rows"),
    "eta_scale": Variable("heart_parameter", "1", "standard deviation of the logit over the training rows"),
    "best_epoch": Variable("", "1", "epoch of the lowest validation loss, whose weights these are"),
    "epochs_run": Variable("", "1", "epochs that were trained"),
    "best_validation_loss": Variable("", "1", "mean of -log q over held-out rows, standardised logit"),
    "architecture": Variable("", "1", "settings of the net and its training, as JSON", text=True),
    "prior": Variable("", "1", "the prior of hearts, as JSON", text=True),
    "conditioner": Variable("", "1", "what the network sees of a recording: features or cells", text=True),
    "conditioning": Variable("", "1", "settings of the conditioner, as JSON", text=True),
}
SHIPPED_NETWORK: Final = Path(__file__).parents[1] / "population.h5"
"""Network of the population that comes with the package; `tools.shipped` makes the file."""


@dataclass(frozen=True)
class TrainedFlow(NetworkFile, kind="flow"):
    """A trained flow q(heart | z) with the weights of its best epoch, and how it was trained.

    The net is of standardised eta = logit(heart), which maps the box of the prior of hearts.
    """

    net: FlowArrays
    settings: FlowSettings
    prior: SimulatedPrior
    conditioner: AnyConditioner
    eta: Standardisation
    best_epoch: int
    epochs_run: int
    best_validation_loss: float

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the C components of z."""
        return self.conditioner.components

    @classmethod
    def schema(cls) -> Schema:
        """Return the one group of the file."""
        return {"/": SCHEMA}

    @classmethod
    def required_labels(cls) -> tuple[Labels, ...]:
        """Return the names of the inputs and of the parameters of hearts."""
        return Labels("component"), Labels("heart_parameter")

    def to_groups(self) -> dict[str, Group]:
        """Return the content of the file; equal flows give equal bytes."""
        (kind,) = (name for name, (own, _) in CONDITIONERS.items() if isinstance(self.conditioner, own))
        of_transforms = (layer for transform in self.net.transforms for layer in transform.layers)
        layers = [*self.net.embedding, *of_transforms]
        values: dict[str, Any] = {
            "weight": np.concatenate([part.ravel() for one in layers for part in (one.weight, one.bias)]),
            "input_mean": self.conditioner.inputs.mean,
            "input_scale": self.conditioner.inputs.scale,
            "eta_mean": self.eta.mean,
            "eta_scale": self.eta.scale,
            "best_epoch": self.best_epoch,
            "epochs_run": self.epochs_run,
            "best_validation_loss": self.best_validation_loss,
            "architecture": self.settings.model_dump_json(),
            "prior": self.prior.model_dump_json(),
            "conditioner": kind,
            "conditioning": self.conditioner.settings.model_dump_json(),
        }
        labels = {"component": list(self.components), "heart_parameter": list(self.prior.names)}
        return {"/": build_group(SCHEMA, values, labels)}

    @classmethod
    def rebuilt(cls, groups: Mapping[str, Group], made: Provenance) -> TrainedFlow:
        """Return the flow of a file's group; a ValueError says that its arrays are of another net."""
        stored = groups["/"]
        settings = FlowSettings.model_validate_json(stored["architecture"].item())
        prior = SimulatedPrior.model_validate_json(stored["prior"].item())
        if (kind := stored["conditioner"].item()) not in CONDITIONERS:
            raise ValueError(f"its conditioner is {kind!r}; known: {', '.join(CONDITIONERS)}")
        sees, seen = CONDITIONERS[kind]
        inputs = Standardisation(stored["input_mean"].to_numpy(), stored["input_scale"].to_numpy())
        conditioner: AnyConditioner = sees(seen.model_validate_json(stored["conditioning"].item()), inputs)
        for label, declared in (("component", conditioner.components), ("heart_parameter", prior.names)):
            names = tuple(stored[label].to_numpy().tolist())
            if names != declared:
                raise ValueError(f"{label!r} names {list(names)}, its settings {list(declared)}")
        weight = stored["weight"].to_numpy()
        return cls(
            net=_from_one_row(weight, settings, len(prior.names), len(conditioner.components)),
            settings=settings,
            prior=prior,
            conditioner=conditioner,
            eta=Standardisation(stored["eta_mean"].to_numpy(), stored["eta_scale"].to_numpy()),
            best_epoch=int(stored["best_epoch"].item()),
            epochs_run=int(stored["epochs_run"].item()),
            best_validation_loss=float(stored["best_validation_loss"].item()),
        )


def _from_one_row(
    weight: SingleArray, settings: FlowSettings, parameters: int, components: int
) -> FlowArrays:
    """Return the net of these weights; a ValueError says that it has another number of them."""
    layers_at_least = settings.transforms * settings.hidden_layers
    if settings.embedding is not None:
        layers_at_least += settings.embedding.hidden_layers
    if layers_at_least > len(weight):  # refused before so many are listed
        raise ValueError(
            f"its settings describe a net of {layers_at_least} layers, it holds {len(weight)} weights"
        )
    embedding, context = [components], components
    if (before := settings.embedding) is not None:
        embedding += [before.hidden_features] * before.hidden_layers + [before.outputs]
        context += before.outputs
    hidden = [settings.hidden_features] * settings.hidden_layers
    transform = [parameters + context, *hidden, PARAMETERS * parameters]
    shapes = [*pairwise(embedding), *settings.transforms * list(pairwise(transform))]
    counts = [(above * below, above) for below, above in shapes]
    if len(weight) != (needed := sum(map(sum, counts))):
        raise ValueError(f"its settings describe a net of {needed} weights, it holds {len(weight)}")
    ends = np.cumsum(np.ravel(counts))[:-1]
    parts = np.split(weight, ends)
    layers = [
        Layer(parts[2 * number].reshape(above, below), parts[2 * number + 1])
        for number, (below, above) in enumerate(shapes)
    ]
    of_embedding, each = len(embedding) - 1, len(transform) - 1
    order = np.arange(parameters)
    return FlowArrays(
        embedding=tuple(layers[:of_embedding]),
        transforms=tuple(
            # zuko.flows.MAF: ascending in even transforms, descending in odd ones
            MaskedTransform(order if number % 2 == 0 else order[::-1], tuple(layers[start : start + each]))
            for number, start in enumerate(range(of_embedding, len(layers), each))
        ),
    )


FARTHEST: Final = -30.0  # in the logit: the lower bound of every parameter


@dataclass(frozen=True)
class FlowProposal:
    """q(heart | z) of a trained flow for one conditioning vector z of shape (C,)."""

    flow: TrainedFlow
    condition: FloatArray

    def __post_init__(self) -> None:
        components = len(self.flow.components)
        if self.condition.shape != (components,):
            raise ValueError(f"z has shape {self.condition.shape}, the flow takes {components} components")
        if not np.isfinite(self.condition).all():
            raise ValueError("z holds values that are not finite; check the recording that it comes from")

    def draw(self, draws: int, seed: int) -> FloatArray:
        """Draw hearts ~ q, always inside the prior's box; shape (draws, k)."""
        rng = np.random.default_rng(seed)
        return self.at(rng.standard_normal((draws, len(self.flow.prior.parameters))))

    def log_density(self, heart: FloatArray) -> FloatArray:
        """Return log q(heart | z), per unit of it, of hearts (n, k); -inf where the map overflows; (n,)."""
        return self.log_density_at(*self.place(heart))

    def log_density_at(self, u: FloatArray, log_slope: FloatArray) -> FloatArray:
        """Return log q of hearts that lie at u (n, k) of the base space, as ``place`` gives both; (n,)."""
        log_q = log_slope + log_normal(u)
        return np.where(np.isfinite(log_q), log_q, -np.inf)

    def place(self, heart: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return hearts (n, k) in the flow's base space, u (n, k), with log |du / dheart| of shape (n,)."""
        flow, eta = self.flow, to_logit(heart, self.flow.prior)
        u, log_slope = self._net.to_base(flow.eta.apply(eta))
        return u, log_slope - np.log(flow.eta.scale).sum() - log_jacobian(eta, flow.prior)

    def at(self, u: FloatArray) -> FloatArray:
        """Return the hearts (n, k) of points u (n, k) of that space.

        Far out the flow's map may overflow, under a condition unlike all that it was trained on. Such a point
        goes to a corner of the box, where no posterior has any mass.
        """
        eta = self._net.from_base(u) * self.flow.eta.scale + self.flow.eta.mean
        eta[~np.isfinite(eta).all(axis=-1)] = FARTHEST
        return from_logit(eta, self.flow.prior)

    @cached_property
    def _net(self) -> ConditionedFlow:
        return self.flow.net.under(self.condition)


def flow_proposal(flow: TrainedFlow, recording: SpeedRecording) -> FlowProposal:
    """Return the flow's posterior of a recording as a proposal.

    A recording of pushes is refused by a flow that was trained on recordings of known phases.
    """
    if recording.cell is not None and not isinstance(flow.conditioner, CellConditioner):
        raise ValueError("this network knows the phases of its own subjects alone; use one over a population")
    return FlowProposal(flow, flow.conditioner.condition(recording))
