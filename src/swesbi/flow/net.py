"""The normalising flow itself: architecture, and its density and draws in phi."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
import zuko
from numpy.typing import NDArray
from torch import Tensor

from swesbi.flow.conditioning import RecordingConditioner
from swesbi.flow.inverse import InverseTransform, inverse_transforms
from swesbi.flow.settings import FlowSettings
from swesbi.inference.determinism import reproducible
from swesbi.inference.standardisation import Standardisation
from swesbi.parameters import PHI_NAMES
from swesbi.prior import JointPriorSettings, from_logit, log_jacobian, to_logit

FloatArray = NDArray[np.float64]
DRAWS_PER_BATCH = 50_000
"""Bounds the memory; fixed, because the random numbers of a batch depend on its size."""


@dataclass(frozen=True)
class TrainedFlow:
    """A trained flow q(phi | z) and how it was trained.

    Attributes:
        net: The flow in standardised eta, on the CPU, with the weights of the best epoch.
        settings: Architecture and training.
        prior: The joint prior whose box the logit maps.
        conditioner: Makes z from recordings.
        eta: Statistics of eta = logit(phi) over the training rows.
        best_epoch: Epoch of the lowest validation loss, from 1.
        epochs_run: Epochs that were trained.
        best_validation_loss: Mean of -log q(eta | z) over held-out theta at the best epoch, standardised eta.
    """

    net: zuko.flows.Flow
    settings: FlowSettings
    prior: JointPriorSettings
    conditioner: RecordingConditioner
    eta: Standardisation
    best_epoch: int
    epochs_run: int
    best_validation_loss: float

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the C components of z."""
        return self.conditioner.components

    @cached_property
    def inverse(self) -> tuple[InverseTransform, ...]:
        """The inverses of the net's transforms, which make its draws."""
        return inverse_transforms(self.net)


def build_net(settings: FlowSettings, components: int) -> zuko.flows.Flow:
    """Build an untrained flow of the four parameters, conditioned on ``components`` numbers."""
    shape = {
        "features": len(PHI_NAMES),
        "context": components,
        "transforms": settings.transforms,
        "hidden_features": (settings.hidden_features,) * settings.hidden_layers,
    }
    if settings.model == "maf":
        return zuko.flows.MAF(**shape)
    return zuko.flows.NSF(**shape, bins=settings.bins)


def draw_phi(flow: TrainedFlow, condition: FloatArray, draws: int, seed: int) -> FloatArray:
    """Draw phi ~ q(phi | z) for each conditioning vector; always inside the prior's box.

    Args:
        flow: The trained flow.
        condition: Conditioning vectors z; shape (B, C).
        draws: Draws for each.
        seed: Seed of the draws.

    Returns:
        Array of shape (B, draws, 4).

    Raises:
        ValueError: z has another number of components than the flow, or holds NaN.
    """
    _check(condition, len(flow.components))
    rows = max(DRAWS_PER_BATCH // draws, 1)
    with reproducible(seed), torch.no_grad():
        parts = [_draw(flow, _tensor(part), draws) for part in _split(condition, rows)]
    eta = np.concatenate(parts) * flow.eta.scale + flow.eta.mean
    return from_logit(eta, flow.prior)


def log_q(flow: TrainedFlow, condition: FloatArray, phi: FloatArray) -> FloatArray:
    """Return log q(phi | z), per unit of phi, of phi (n, 4) under one conditioning vector (C,); shape (n,).

    Raises:
        ValueError: z has another number of components than the flow, or holds NaN.
    """
    _check(condition[None], len(flow.components))
    eta = to_logit(phi, flow.prior)
    row, standardised = _tensor(condition), _tensor(flow.eta.apply(eta))
    with reproducible(0), torch.no_grad():
        parts = [
            flow.net(row.expand(len(part), -1)).log_prob(part)
            for part in torch.split(standardised, DRAWS_PER_BATCH)
        ]
    log_density = torch.cat(parts).numpy().astype(np.float64)
    return np.asarray(log_density - np.log(flow.eta.scale).sum() - log_jacobian(eta, flow.prior))


def _draw(flow: TrainedFlow, condition: Tensor, draws: int) -> FloatArray:
    """Draw standardised eta for conditions (B, C); shape (B, draws, 4)."""
    base = flow.net(condition).base.sample((draws,))
    eta = base.flatten(0, 1)
    conditions = condition.expand(draws, *condition.shape).flatten(0, 1)
    for inverse in flow.inverse:
        eta = inverse(eta, conditions)
    drawn: FloatArray = eta.view(base.shape).transpose(0, 1).numpy().astype(np.float64)
    return drawn


def _split(condition: FloatArray, rows: int) -> Iterator[FloatArray]:
    for start in range(0, len(condition), rows):
        yield condition[start : start + rows]


def _tensor(values: FloatArray) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(values, dtype=np.float32))


def _check(condition: FloatArray, components: int) -> None:
    if condition.ndim != 2 or condition.shape[1] != components:
        raise ValueError(f"z has shape {condition.shape}, the flow takes {components} components")
    if not np.isfinite(condition).all():
        raise ValueError("z holds values that are not finite; check the recording that it comes from")
