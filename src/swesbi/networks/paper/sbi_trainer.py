"""sbi's NPE-C as it is, with a hook after each epoch."""

from __future__ import annotations

import time
from collections.abc import Collection
from functools import partial
from typing import Any

import torch
from sbi.inference import NPE_C
from sbi.neural_nets import posterior_nn
from sbi.neural_nets.estimators import ConditionalDensityEstimator
from torch import Tensor
from torch.utils.data import DataLoader, Dataset

from swesbi.networks.paper.estimator import SbiFlow
from swesbi.networks.paper.weights import arrays_of
from swesbi.networks.settings import EstimatorSettings
from swesbi.networks.torch_prior import torch_prior
from swesbi.networks.training import EpochRecord
from swesbi.prior import PriorSettings


class SbiTrainer(NPE_C):  # type: ignore[misc] # sbi is untyped for us
    """sbi's NPE-C with a hook after each epoch and batches gathered at once.

    sbi tells its tracker nothing before training has ended, and its loader collates rows one by one.
    The batches hold the same rows in the same order, so the course of training is exactly the same.
    """

    def __init__(
        self,
        record: EpochRecord,
        prior: PriorSettings,
        settings: EstimatorSettings,
        device: str,
        keep: Collection[int],
    ) -> None:
        self._record = record
        self._keep = frozenset(keep)
        self.flows: dict[int, SbiFlow] = {}
        """After the epochs asked for, the best and the last, by epoch, in their order."""
        super().__init__(
            prior=torch_prior(prior, device),
            density_estimator=partial(build_net, settings=settings),
            device=device,
            tracker=_NoTracker(),
            show_progress_bars=False,
        )

    def get_dataloaders(
        self, *args: object, **kwargs: object
    ) -> tuple[DataLoader[list[Tensor]], DataLoader[list[Tensor]]]:
        """Return sbi's loaders over training and validation rows, with batches gathered at once."""
        training, validation = super().get_dataloaders(*args, **kwargs)
        return _whole_batches(training), _whole_batches(validation)

    def _summarize_epoch(self, train_loss: float, val_loss: float, start: float, *args: object) -> None:
        super()._summarize_epoch(train_loss, val_loss, start, *args)
        last = self._record.add(train_loss, val_loss, time.time() - start)
        wanted = self._keep | {self._record.best.number}
        self.flows = {number: flow for number, flow in self.flows.items() if number in wanted}
        self.flows[last.number] = arrays_of(self._neural_net)


def build_net(theta: Tensor, z: Tensor, settings: EstimatorSettings) -> ConditionalDensityEstimator:
    """Build an untrained estimator; theta (N, 3) and z (N, C) give its shapes and sbi's standardisation."""
    net: ConditionalDensityEstimator = posterior_nn(
        model=settings.model,
        z_score_theta=settings.z_score_theta,
        z_score_x=settings.z_score_x,
        hidden_features=settings.hidden_features,
        num_transforms=settings.transforms,
        num_blocks=settings.blocks,
    )(theta, z)
    return net


class _NoTracker:
    """A tracker that keeps nothing; without one sbi writes a folder ./sbi-logs."""

    log_dir = None

    def log_metric(self, name: str, value: float, step: int | None = None) -> None: ...

    def flush(self) -> None: ...


class _Batches(Dataset[list[Tensor]]):
    """Rows of tensors, fetched a batch at a time by index."""

    def __init__(self, tensors: tuple[Tensor, ...]) -> None:
        self.tensors = tensors

    def __getitems__(self, indices: list[int]) -> list[Tensor]:
        rows = torch.tensor(indices, device=self.tensors[0].device)
        return [tensor[rows] for tensor in self.tensors]


def _whole_batches(loader: DataLoader[Any]) -> DataLoader[Any]:
    """The same loader over the same sampler, but without collating rows one by one."""
    return DataLoader(
        _Batches(loader.dataset.tensors),  # type: ignore[attr-defined]
        batch_size=loader.batch_size,
        sampler=loader.sampler,
        drop_last=loader.drop_last,
        collate_fn=list,
    )
