"""The trained flow, and its file: weights in one row, what standardises its numbers, its settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from swesbi.artefacts import (
    Artefact,
    ArtefactError,
    DamagedArtefactError,
    Group,
    Labels,
    Provenance,
    Variable,
    build_group,
)
from swesbi.artefacts.schema import Schema
from swesbi.measurement.settings import summary_names
from swesbi.networks.affine_maf import PARAMETERS, Layer, SingleArray
from swesbi.networks.flow import cells, conditioning
from swesbi.networks.flow.arrays import FlowArrays, MaskedTransform
from swesbi.networks.settings import FlowSettings
from swesbi.networks.standardisation import Standardisation
from swesbi.prior import SimulatedPrior

FEATURES: Final = "features"
CELLS: Final = "cells"
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
class TrainedFlow(Artefact, kind="flow"):
    """A trained flow q(heart | z) with the weights of its best epoch, and how it was trained.

    The net is of standardised eta = logit(heart), which maps the box of the prior of hearts.
    """

    net: FlowArrays
    settings: FlowSettings
    prior: SimulatedPrior
    conditioner: cells.AnyConditioner
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
        kind, settings, inputs = _described(self.conditioner)
        of_transforms = (layer for transform in self.net.transforms for layer in transform.layers)
        layers = [*self.net.embedding, *of_transforms]
        values: dict[str, Any] = {
            "weight": np.concatenate([part.ravel() for one in layers for part in (one.weight, one.bias)]),
            "input_mean": inputs.mean,
            "input_scale": inputs.scale,
            "eta_mean": self.eta.mean,
            "eta_scale": self.eta.scale,
            "best_epoch": self.best_epoch,
            "epochs_run": self.epochs_run,
            "best_validation_loss": self.best_validation_loss,
            "architecture": self.settings.model_dump_json(),
            "prior": self.prior.model_dump_json(),
            "conditioner": kind,
            "conditioning": settings,
        }
        labels = {"component": list(self.components), "heart_parameter": list(self.prior.names)}
        return {"/": build_group(SCHEMA, values, labels)}

    @classmethod
    def read(cls, path: Path) -> TrainedFlow:
        """Read a flow; errors are those of every artefact."""
        try:
            return super().read(path)
        except ArtefactError:
            raise
        except ValueError as error:
            raise DamagedArtefactError(path, str(error)) from error

    @classmethod
    def rebuilt(cls, groups: Mapping[str, Group], made: Provenance) -> TrainedFlow:
        """Return the flow of a file's group; a ValueError says that its weights are of another net."""
        stored = groups["/"]
        settings = FlowSettings.model_validate_json(stored["architecture"].item())
        parameters, components = stored.sizes["heart_parameter"], stored.sizes["component"]
        return cls(
            net=_from_one_row(stored["weight"].to_numpy(), settings, parameters, components),
            settings=settings,
            prior=SimulatedPrior.model_validate_json(stored["prior"].item()),
            conditioner=_conditioner(stored),
            eta=Standardisation(stored["eta_mean"].to_numpy(), stored["eta_scale"].to_numpy()),
            best_epoch=int(stored["best_epoch"].item()),
            epochs_run=int(stored["epochs_run"].item()),
            best_validation_loss=float(stored["best_validation_loss"].item()),
        )


def _from_one_row(
    weight: SingleArray, settings: FlowSettings, parameters: int, components: int
) -> FlowArrays:
    """Return the net of these weights; a ValueError says that it has another number of them."""
    embedding, context = [components], components
    if (before := settings.embedding) is not None:
        embedding += [before.hidden_features] * before.hidden_layers + [before.outputs]
        context += before.outputs
    hidden = [settings.hidden_features] * settings.hidden_layers
    transform = [parameters + context, *hidden, PARAMETERS * parameters]
    shapes = [*pairwise(embedding), *settings.transforms * list(pairwise(transform))]
    counts = [(above * below, above) for below, above in shapes]
    if len(weight) != (needed := int(np.sum(counts))):
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


def _described(conditioner: cells.AnyConditioner) -> tuple[str, str, Standardisation]:
    """Return kind and settings of a conditioner, and the statistics of all its components."""
    settings = conditioner.settings.model_dump_json()
    if isinstance(conditioner, cells.CellConditioner):
        return CELLS, settings, conditioner.inputs
    parts = conditioner.features, conditioner.context
    both = [np.concatenate(values) for values in zip(*((p.mean, p.scale) for p in parts), strict=True)]
    return FEATURES, settings, Standardisation(*both)


def _conditioner(stored: Group) -> cells.AnyConditioner:
    mean, scale = stored["input_mean"].to_numpy(), stored["input_scale"].to_numpy()
    if stored["conditioner"].item() == CELLS:
        seen = cells.CellSettings.model_validate_json(stored["conditioning"].item())
        return cells.CellConditioner(seen, Standardisation(mean, scale))
    settings = conditioning.ConditioningSettings.model_validate_json(stored["conditioning"].item())
    features = len(summary_names(settings.summary))
    return conditioning.Conditioner(
        settings,
        Standardisation(mean[:features], scale[:features]),
        Standardisation(mean[features:], scale[features:]),
    )
