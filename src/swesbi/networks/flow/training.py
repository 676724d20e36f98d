"""A flow's net, and its training by maximum likelihood of rows made anew every epoch (paper, Eq. 8)."""

from __future__ import annotations

import copy
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple, TypeVar

import numpy as np
import torch
import zuko
from torch import Tensor
from zuko.distributions import NormalizingFlow
from zuko.flows.autoregressive import MaskedAutoregressiveTransform
from zuko.nn import MLP, Linear, MaskedLinear

from swesbi.base.arrays import FloatArray
from swesbi.base.progress import LOGGER
from swesbi.measurement.likelihood import SpeedModelSettings, speed_model
from swesbi.measurement.settings import SummarySettings
from swesbi.networks.affine_maf import Layer, SingleArray
from swesbi.networks.files import Standardisation, fit_standardisation
from swesbi.networks.flow.conditioning import (
    AnyConditioner,
    Conditioner,
    ConditioningSettings,
    conditioning_of,
    fit_conditioner,
    raw_features,
)
from swesbi.networks.flow.pool import SpeedPool, SubjectSimulations, noisy_speeds
from swesbi.networks.flow.trained import FlowArrays, MaskedTransform, TrainedFlow
from swesbi.networks.settings import FlowSettings
from swesbi.networks.training import EpochRecord, FlowEpoch, TrainingTable, losses_table, reproducible
from swesbi.prior import SimulatedPrior, to_logit
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.seeds import generator, integer_seed


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


Part = TypeVar("Part")
"""Simulations on one side of a split."""
VALIDATION_COPIES: Final = 2  # recordings of each held-out theta; fixed over the epochs
MAX_BAD_FRACTION: Final = 0.01  # of an epoch's batches whose loss is not finite


@dataclass(frozen=True)
class Rows:
    """Training rows of all subjects: standardised eta = logit(heart), (N, k), and z of shape (N, C)."""

    eta: SingleArray
    z: SingleArray


def single(values: FloatArray) -> SingleArray:
    """Return values in the precision that networks are trained in."""
    return values.astype(np.float32)


def split_by_theta(
    subjects: Sequence[SubjectSimulations], validation_fraction: float
) -> tuple[list[SubjectSimulations], list[SubjectSimulations]]:
    """Split each subject's simulations into training and held-out theta, the last ones held out.

    Draws from the prior come in no order, so the last are as good as any; no theta is on both sides.
    """
    counts = [len(subject.theta) for subject in subjects]
    edges = [n - round(validation_fraction * n) for n in counts]
    if any(not 0 < edge < n for edge, n in zip(edges, counts, strict=True)):
        raise ValueError(
            f"{min(counts)} simulations cannot be split with validation_fraction = {validation_fraction}; "
            "simulate more or change the fraction"
        )
    training = [subject.rows(0, edge) for subject, edge in zip(subjects, edges, strict=True)]
    held_out = [subject.rows(edge, n) for subject, edge, n in zip(subjects, edges, counts, strict=True)]
    return training, held_out


def fit_statistics(
    subjects: Sequence[SubjectSimulations], settings: ConditioningSettings, seed: int
) -> tuple[Conditioner, Standardisation]:
    """Take the statistics of z and eta over one epoch of training rows."""
    eta, features = zip(*(_raw(subject, settings, seed, "statistics") for subject in subjects), strict=True)
    contexts = tuple(subject.model.recording.context for subject in subjects)
    conditioner = fit_conditioner(np.concatenate(features), contexts, settings)
    return conditioner, fit_standardisation(np.concatenate(eta))


def make_rows(
    subjects: Sequence[SubjectSimulations],
    conditioner: Conditioner,
    eta: Standardisation,
    seed: int,
    *name: str | int,
) -> Rows:
    """Make one epoch's rows; the stream of each subject depends on the seed, the name and the subject."""
    raw = [_raw(subject, conditioner.settings, seed, *name) for subject in subjects]
    z = [
        conditioner.standardise(features, subject.model.recording.context)
        for (_, features), subject in zip(raw, subjects, strict=True)
    ]
    return Rows(single(eta.apply(np.concatenate([rows for rows, _ in raw]))), single(np.concatenate(z)))


def _raw(
    simulations: SubjectSimulations, settings: ConditioningSettings, seed: int, *name: str | int
) -> tuple[FloatArray, FloatArray]:
    """Return eta (n, k) and features (n, F) of noisy recordings, one of each simulation."""
    recording = simulations.model.recording
    rng = generator(seed, "flow", *name, recording.subject)
    speeds, prior = noisy_speeds(simulations, rng), simulations.model.settings.prior.simulated
    heart = np.hstack([simulations.theta, simulations.physiology])
    return to_logit(heart, prior), raw_features(speeds, recording.phase, settings)


class TrainingDivergedError(RuntimeError):
    """Too many batches had no finite loss; the message says what to do."""


class TrainedWithLosses(NamedTuple):
    """A trained flow, and the losses of every epoch."""

    estimator: TrainedFlow
    training: TrainingTable


def trained_on_subjects(
    pool: SpeedPool,
    observations: tuple[Observation, ...],
    noise: CohortNoise,
    *,
    model: SpeedModelSettings,
    summary: SummarySettings,
    estimator: FlowSettings,
    experiment: str,
    seed: int,
) -> TrainedWithLosses:
    """Train q(heart | z) on the pool of all subjects; ``summary`` says which features the network sees.

    Runs on the CPU, on one thread, and repeats exactly.

    Raises:
        UnfitError: The pool lacks a subject.
        TrainingDivergedError: The loss was not finite too often.
    """
    subjects = [pool.of(speed_model(observed, noise, model)) for observed in observations]
    return train_over_subjects(
        subjects,
        conditioning_of(summary, model),
        estimator,
        integer_seed(seed, "flow training"),
        f"training {experiment}",
    )


def train_over_subjects(
    subjects: Sequence[SubjectSimulations],
    conditioning: ConditioningSettings,
    settings: FlowSettings,
    seed: int,
    label: str = "training",
) -> TrainedWithLosses:
    """Fit q(heart | z) on the simulations of all subjects, noise drawn anew every epoch.

    Theta are split into training and held-out ones; standardisation comes from the training ones; the
    weights of the best epoch on the held-out ones are kept. Runs on one thread and repeats exactly.
    """
    training, held_out = split_by_theta(subjects, settings.validation_fraction)
    conditioner, eta = fit_statistics(training, conditioning, seed)

    def rows_of(part: Sequence[SubjectSimulations], name: str, number: int) -> Rows:
        return make_rows(part, conditioner, eta, seed, name, number)

    parts = FlowParts(conditioner, eta, subjects[0].model.settings.prior.simulated)
    return fit_flow(training, held_out, rows_of, parts, settings, seed, label)


@dataclass(frozen=True)
class FlowParts:
    """What a flow has beside its net: what makes z, statistics of eta = logit(heart), the prior of hearts."""

    conditioner: AnyConditioner
    eta: Standardisation
    prior: SimulatedPrior


def fit_flow(
    training: Part,
    held_out: Part,
    rows_of: Callable[[Part, str, int], Rows],
    parts: FlowParts,
    settings: FlowSettings,
    seed: int,
    label: str,
) -> TrainedWithLosses:
    """Fit a flow to fresh rows every epoch and keep the weights of the best epoch on the held-out rows.

    ``rows_of`` makes rows of a part, by what they are for and a number: as many each time. Rows of training
    are drawn anew every epoch, those held out are the same for all.
    """
    validation = [rows_of(held_out, "validation", k) for k in range(VALIDATION_COPIES)]
    with reproducible(integer_seed(seed, "flow", "torch")):
        rows = rows_of(training, "epoch", 1)
        trainer = _Trainer(settings, rows, label)
        trainer.run(rows, validation)
        for number in range(2, settings.epochs + 1):
            del rows  # else there are two epochs' rows while the next ones are made
            rows = rows_of(training, "epoch", number)
            trainer.run(rows, validation)
    best = trainer.record.best
    LOGGER.info(
        "%s: best epoch %d of %d, loss %.4f", label, best.number, settings.epochs, best.validation_loss
    )
    flow = TrainedFlow(
        net=arrays_of(trainer.best_net()),
        settings=settings,
        prior=parts.prior,
        conditioner=parts.conditioner,
        eta=parts.eta,
        best_epoch=best.number,
        epochs_run=settings.epochs,
        best_validation_loss=best.validation_loss,
    )
    return TrainedWithLosses(flow, losses_table(trainer.record.epochs))


class _Trainer:
    """Trains one network: its optimiser, its schedule, and the epochs so far."""

    def __init__(self, settings: FlowSettings, rows: Rows, label: str) -> None:
        self.record = EpochRecord(label, settings.epochs, FlowEpoch)
        self._settings = settings
        self._net = build_net(settings, rows.eta.shape[1], rows.z.shape[1])
        self._best = copy.deepcopy(self._net.state_dict())
        self._batches = max(len(rows.eta) // settings.batch_size, 1)
        self._optimiser = torch.optim.Adam(self._net.parameters(), lr=settings.learning_rate, fused=True)
        # One cycle of the learning rate: up within the warm-up, then down (Smith and Topin 2019).
        self._schedule = torch.optim.lr_scheduler.OneCycleLR(
            self._optimiser,
            settings.learning_rate,
            total_steps=settings.epochs * self._batches,
            pct_start=settings.warm_up_fraction,
        )

    def run(self, rows: Rows, validation: Sequence[Rows]) -> None:
        """Train one epoch on these rows and judge it on the held-out ones."""
        start = time.monotonic()
        training_loss, skipped = self._pass(torch.from_numpy(rows.eta), torch.from_numpy(rows.z))
        loss = float(np.mean([self._judge(rows_held_out) for rows_held_out in validation]))
        seconds = time.monotonic() - start
        if self.record.add(training_loss, loss, seconds, skipped_batches=skipped).best_so_far:
            self._best = copy.deepcopy(self._net.state_dict())

    def best_net(self) -> ConditionalFlow:
        """Return the network with the weights of the best epoch."""
        self._net.load_state_dict(self._best)
        return self._net

    def _pass(self, eta: Tensor, z: Tensor) -> tuple[float, int]:
        self._net.train()
        order = torch.randperm(len(eta))
        losses: list[float] = []
        for batch in torch.split(order, self._settings.batch_size)[: self._batches]:
            losses.append(self._step(eta[batch], z[batch]))
        finite = [loss for loss in losses if np.isfinite(loss)]
        skipped = len(losses) - len(finite)
        if skipped > MAX_BAD_FRACTION * len(losses):
            raise TrainingDivergedError(
                f"epoch {len(self.record.epochs) + 1}: {skipped} of {len(losses)} batches had no finite "
                "loss; lower learning_rate or clip_max_norm"
            )
        return float(np.mean(finite)), skipped

    def _step(self, eta: Tensor, z: Tensor) -> float:
        """Take one step, unless the loss is not finite; the schedule moves on in any case."""
        self._optimiser.zero_grad()
        loss = -self._net(z).log_prob(eta).mean()
        if torch.isfinite(loss):
            loss.backward()
            torch.nn.utils.clip_grad_norm_(self._net.parameters(), self._settings.clip_max_norm)
            self._optimiser.step()
        self._schedule.step()
        return float(loss.detach())

    def _judge(self, rows: Rows) -> float:
        self._net.eval()
        with torch.no_grad():
            z, eta = torch.from_numpy(rows.z), torch.from_numpy(rows.eta)
            loss: Tensor = -self._net(z).log_prob(eta).mean()
        return float(loss)
