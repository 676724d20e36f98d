"""The spline flow q(phi | z): architecture, density, and draws.

The inverse of a masked autoregressive transform goes coordinate by coordinate: the parameters of one depend
on those before it (Papamakarios, Pavlakou and Murray 2017, Sec. 3). zuko evaluates the whole network and
every coordinate's transform in each of these passes and keeps one. Here a pass evaluates the units that its
coordinate needs and no earlier pass has: the same sums of the same terms, hence the same draws.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
import torch
import torch.nn.functional as F
import zuko
from torch import Tensor
from zuko.distributions import NormalizingFlow
from zuko.flows.autoregressive import MaskedAutoregressiveTransform
from zuko.nn import MLP, MaskedLinear
from zuko.utils import unpack

from swesbi.arrays import FloatArray
from swesbi.networks.determinism import reproducible
from swesbi.networks.settings import SplineSettings
from swesbi.networks.spline.conditioning import RecordingConditioner
from swesbi.networks.standardisation import Standardisation
from swesbi.prior import JointPriorSettings, from_logit, log_jacobian, to_logit

FARTHEST: Final = -30.0  # in the logit: the lower bound of every parameter
DRAWS_PER_BATCH = 50_000
"""Bounds the memory; fixed, because the random numbers of a batch depend on its size."""


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

    def of_embedded(self, embedded: Tensor) -> NormalizingFlow:
        """Return the densities under conditions that are embedded already."""
        return super().forward(embedded)

    def forward(self, c: Tensor | None = None) -> NormalizingFlow:
        """Return the densities under conditions c (n, C)."""
        if c is None:
            raise ValueError("the flow is conditional; give it conditioning vectors")
        return self.of_embedded(self.embed(c))


@dataclass(frozen=True)
class _Units:
    """Units of one layer that a pass evaluates: their rows in the layer, weights and biases."""

    rows: Tensor
    weight: Tensor
    bias: Tensor


@dataclass(frozen=True)
class _Pass:
    """One pass: the coordinates that it finds, and the units it evaluates, layer by layer."""

    coordinates: Tensor
    layers: tuple[_Units, ...]


@dataclass(frozen=True)
class InverseTransform:
    """The inverse of one transform, x from y; ``widths`` are the numbers of hidden units."""

    transform: MaskedAutoregressiveTransform
    passes: tuple[_Pass, ...]
    widths: tuple[int, ...]

    def __call__(self, y: Tensor, condition: Tensor) -> Tensor:
        """Return x (n, d) for y (n, d) under conditions (n, C)."""
        # Coordinates not yet found are zero; what a pass evaluates does not depend on them.
        known = torch.cat((torch.zeros_like(y), condition), dim=1)
        hidden = [torch.zeros(len(y), width) for width in self.widths]
        for step in self.passes:
            parameters = _evaluate(step.layers, known, hidden)
            # In closed form: a spline is inverted by a quadratic equation in the bin that y falls into
            # (Durkan et al. 2019, Neural Spline Flows, App. A.1), and is the identity outside its bins.
            parts = unpack(parameters.view(len(y), -1, self.transform.total), self.transform.shapes)
            univariate: Any = self.transform.univariate(*parts)
            known[:, step.coordinates] = univariate.inv(y[:, step.coordinates])
        return known[:, : y.shape[1]]


def inverse_transforms(net: zuko.flows.Flow) -> tuple[InverseTransform, ...]:
    """Return the inverses of a flow's transforms, in the order in which they make draws of its base.

    They hold copies of the weights: a network that learns on needs new ones.

    Raises:
        ValueError: A transform is no masked autoregressive one with rectified linear units.
    """
    return tuple(_inverse(transform) for transform in reversed(net.transform.transforms))


def _evaluate(layers: Sequence[_Units], known: Tensor, hidden: Sequence[Tensor]) -> Tensor:
    """Fill in the hidden units of a pass and return the parameters that it finds."""
    values = known
    for units, layer in zip(layers[:-1], hidden, strict=True):
        layer[:, units.rows] = F.relu(F.linear(values, units.weight, units.bias))
        values = layer
    return F.linear(values, layers[-1].weight, layers[-1].bias)


def _inverse(transform: torch.nn.Module) -> InverseTransform:
    if not isinstance(transform, MaskedAutoregressiveTransform) or transform.order is None:
        raise ValueError(f"draws are made by masked autoregressive transforms; found {transform}")
    layers = [layer for layer in transform.hyper if isinstance(layer, MaskedLinear)]
    between = [layer for layer in transform.hyper if not isinstance(layer, MaskedLinear)]
    if not all(isinstance(layer, torch.nn.ReLU) for layer in between):
        raise ValueError(f"draws are made with rectified linear units; found {between}")
    done = [torch.zeros(layer.out_features, dtype=torch.bool) for layer in layers]
    passes = []
    for number in range(transform.passes):
        coordinates = torch.nonzero(transform.order == number).squeeze(1)
        outputs = torch.zeros(layers[-1].out_features, dtype=torch.bool)
        outputs.view(-1, transform.total)[coordinates] = True
        passes.append(_Pass(coordinates, _new_units(layers, outputs, done)))
    return InverseTransform(transform, tuple(passes), tuple(layer.out_features for layer in layers[:-1]))


def _new_units(layers: Sequence[MaskedLinear], outputs: Tensor, done: Sequence[Tensor]) -> tuple[_Units, ...]:
    """Return the units that these outputs depend on and that are not in ``done``, where they are added."""
    needed, new_units = outputs, []
    for layer, before in zip(reversed(layers), reversed(done), strict=True):
        # Backwards from the outputs: what a layer must have is what the one above reads through its mask.
        rows = torch.nonzero(needed & ~before).squeeze(1)
        before |= needed
        weight = (layer.mask * layer.weight).detach()
        new_units.append(_Units(rows, weight[rows], layer.bias.detach()[rows]))
        needed = layer.mask[needed].any(dim=0)
    return tuple(reversed(new_units))


@dataclass(frozen=True)
class TrainedSpline:
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

    net: ConditionalFlow
    settings: SplineSettings
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


def build_net(settings: SplineSettings, parameters: int, components: int) -> ConditionalFlow:
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
    if settings.model == "maf":
        return ConditionalFlow(zuko.flows.MAF(**shape), embedding)
    return ConditionalFlow(zuko.flows.NSF(**shape, bins=settings.bins), embedding)


def draw_phi(spline: TrainedSpline, condition: FloatArray, draws: int, seed: int) -> FloatArray:
    """Draw phi ~ q(phi | z) for each conditioning vector; always inside the prior's box.

    Args:
        spline: The trained flow.
        condition: Conditioning vectors z; shape (B, C).
        draws: Draws for each.
        seed: Seed of the draws.

    Returns:
        Array of shape (B, draws, d).

    Raises:
        ValueError: z has another number of components than the flow, or holds NaN.
    """
    _check(condition, len(spline.components))
    rows = max(DRAWS_PER_BATCH // draws, 1)
    with reproducible(seed), torch.no_grad():
        starts = range(0, len(condition), rows)
        parts = [_draw(spline, _tensor(condition[start : start + rows]), draws) for start in starts]
    return _in_box(spline, np.concatenate(parts))


def log_q(spline: TrainedSpline, condition: FloatArray, phi: FloatArray) -> FloatArray:
    """Return log q(phi | z), per unit of phi, of phi (n, d) under one conditioning vector (C,); shape (n,).

    Raises:
        ValueError: z has another number of components than the flow, or holds NaN.
    """
    _check(condition[None], len(spline.components))
    eta = to_logit(phi, spline.prior)
    parts = _in_batches(spline, condition, eta, lambda flow, part: flow.log_prob(part))
    log_density = torch.cat(parts).numpy().astype(np.float64)
    return log_density - _log_standardised(spline, eta)


def to_base(spline: TrainedSpline, condition: FloatArray, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return where phi (n, d) lie in the flow's base space, u (n, d), and log |du / dphi| of shape (n,).

    There the flow's own density is standard normal.

    Raises:
        ValueError: z has another number of components than the flow, or holds NaN.
    """
    _check(condition[None], len(spline.components))
    eta = to_logit(phi, spline.prior)
    parts = _in_batches(spline, condition, eta, lambda flow, part: flow.transform.call_and_ladj(part))
    u, slope = (torch.cat(columns).numpy().astype(np.float64) for columns in zip(*parts, strict=True))
    return u, slope - _log_standardised(spline, eta)


def _in_batches(
    spline: TrainedSpline, condition: FloatArray, eta: FloatArray, evaluate: Callable[[Any, Tensor], Any]
) -> list[Any]:
    """Return what the flow under one condition says of eta (n, d), standardised, batch by batch."""
    standardised = _tensor(spline.eta.apply(eta))
    with reproducible(0), torch.no_grad():
        row = spline.net.embed(_tensor(condition[None]))
        return [
            evaluate(spline.net.of_embedded(row.expand(len(part), -1)), part)
            for part in torch.split(standardised, DRAWS_PER_BATCH)
        ]


def _log_standardised(spline: TrainedSpline, eta: FloatArray) -> FloatArray:
    """Return log |d phi / d standardised eta| at eta (n, d); shape (n,)."""
    return np.asarray(np.log(spline.eta.scale).sum() + log_jacobian(eta, spline.prior))


def from_base(spline: TrainedSpline, condition: FloatArray, u: FloatArray) -> FloatArray:
    """Return the phi (n, d) of points u (n, d) of the base space; errors as of :func:`to_base`."""
    _check(condition[None], len(spline.components))
    with reproducible(0), torch.no_grad():
        row = spline.net.embed(_tensor(condition[None]))
        parts = [_invert(spline, part, row) for part in torch.split(_tensor(u), DRAWS_PER_BATCH)]
    return _in_box(spline, torch.cat(parts).numpy().astype(np.float64))


def _in_box(spline: TrainedSpline, standardised: FloatArray) -> FloatArray:
    """Return the phi (..., d) of standardised eta (..., d).

    A point so far out that the flow's map overflows, as it may under a condition that is unlike all that it
    was trained on, goes to a corner of the box, where no posterior has any mass.
    """
    eta = standardised * spline.eta.scale + spline.eta.mean
    eta[~np.isfinite(eta).all(axis=-1)] = FARTHEST
    return from_logit(eta, spline.prior)


def _draw(spline: TrainedSpline, condition: Tensor, draws: int) -> FloatArray:
    """Draw standardised eta for conditions (B, C); shape (B, draws, d)."""
    embedded = spline.net.embed(condition)
    base = spline.net.of_embedded(embedded).base.sample((draws,))
    conditions = embedded.expand(draws, *embedded.shape).flatten(0, 1)
    eta = _invert(spline, base.flatten(0, 1), conditions)
    drawn: FloatArray = eta.view(base.shape).transpose(0, 1).numpy().astype(np.float64)
    return drawn


def _invert(spline: TrainedSpline, u: Tensor, condition: Tensor) -> Tensor:
    """Return standardised eta (n, d) of points u (n, d) of the base space, under embedded conditions."""
    conditions = condition.expand(len(u), condition.shape[-1])
    for inverse in spline.inverse:
        u = inverse(u, conditions)
    return u


def _tensor(values: FloatArray) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(values, dtype=np.float32))


def _check(condition: FloatArray, components: int) -> None:
    if condition.ndim != 2 or condition.shape[1] != components:
        raise ValueError(f"z has shape {condition.shape}, the flow takes {components} components")
    if not np.isfinite(condition).all():
        raise ValueError("z holds values that are not finite; check the recording that it comes from")
