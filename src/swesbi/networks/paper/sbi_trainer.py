"""sbi's NPE-C as it is, with a hook after each epoch."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping
from typing import Any

import torch
from sbi.inference import NPE_C
from sbi.neural_nets import posterior_nn
from sbi.neural_nets.estimators import ConditionalDensityEstimator
from torch import Tensor
from torch.utils.data import DataLoader, Dataset

from swesbi.base.progress import Progress
from swesbi.networks.settings import EstimatorSettings
from swesbi.networks.torch_prior import torch_prior
from swesbi.networks.training_tables import Epoch
from swesbi.prior import PriorSettings


class EpochRecord:
    """Collects the epochs and logs a line for each."""

    def __init__(self, label: str, at_most: int) -> None:
        self.epochs: list[Epoch] = []
        self.best_loss = float("inf")
        self._progress = Progress(label, at_most, unit="epoch", every_s=0.0)

    def add(self, training_loss: float, validation_loss: float, seconds: float) -> None:
        """Take in one epoch."""
        improved = validation_loss < self.best_loss
        self.best_loss = min(validation_loss, self.best_loss)
        self.epochs.append(Epoch(len(self.epochs) + 1, training_loss, validation_loss, improved))
        losses = f"loss {training_loss:.4f}, validation {validation_loss:.4f}{' (best)' if improved else ''}"
        self._progress.step(note=f"{losses}, {seconds:.1f} s")

    @property
    def number(self) -> int:
        """Epochs so far."""
        return len(self.epochs)

    @property
    def best(self) -> tuple[int, int]:
        """The best epoch's number and the number of epochs run."""
        return max(epoch.number for epoch in self.epochs if epoch.best_so_far), len(self.epochs)


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
        self._kept: dict[int, dict[str, Tensor]] = {}
        self._last: dict[str, Tensor] = {}

        def build(theta: Tensor, z: Tensor) -> object:
            return build_net(theta, z, settings)

        super().__init__(
            prior=torch_prior(prior, device),
            density_estimator=build,
            device=device,
            tracker=_NoTracker(),
            show_progress_bars=False,
        )

    @property
    def best_state(self) -> dict[str, Tensor]:
        """The weights of the epoch with the lowest validation loss."""
        state: dict[str, Tensor] = self._best_model_state_dict
        return state

    @property
    def kept(self) -> dict[int, dict[str, Tensor]]:
        """The weights after the epochs asked for and after the last, by epoch."""
        return self._kept | {self._record.number: self._last}

    def get_dataloaders(
        self, *args: object, **kwargs: object
    ) -> tuple[DataLoader[list[Tensor]], DataLoader[list[Tensor]]]:
        """Return sbi's loaders over training and validation rows, with batches gathered at once."""
        training, validation = super().get_dataloaders(*args, **kwargs)
        return _whole_batches(training), _whole_batches(validation)

    def _summarize_epoch(self, train_loss: float, val_loss: float, start: float, *args: object) -> None:
        super()._summarize_epoch(train_loss, val_loss, start, *args)
        self._record.add(train_loss, val_loss, time.time() - start)
        # Which epoch is the last, nobody knows before sbi puts the best weights in its place.
        self._last = on_cpu(self._neural_net.state_dict())
        if (number := self._record.number) in self._keep:
            self._kept[number] = self._last


def on_cpu(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Return a copy of the weights that training on does not change."""
    return {name: value.detach().to("cpu", copy=True) for name, value in state.items()}


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

    def log_metrics(self, metrics: dict[str, float], step: int | None = None) -> None: ...

    def log_params(self, params: dict[str, Any]) -> None: ...

    def add_figure(self, name: str, figure: object, step: int | None = None) -> None: ...

    def flush(self) -> None: ...


class _Batches(Dataset[list[Tensor]]):
    """Rows of tensors, fetched a batch at a time by index."""

    def __init__(self, tensors: tuple[Tensor, ...]) -> None:
        self.tensors = tensors

    def __len__(self) -> int:
        return len(self.tensors[0])

    def __getitem__(self, index: int) -> list[Tensor]:
        return [tensor[index] for tensor in self.tensors]

    def __getitems__(self, indices: list[int]) -> list[Tensor]:
        rows = torch.tensor(indices, device=self.tensors[0].device)
        return [tensor[rows] for tensor in self.tensors]


def _whole_batches(loader: DataLoader[Any]) -> DataLoader[Any]:
    """The same loader over the same sampler, but without collating rows one by one."""
    keep: Callable[[list[Tensor]], list[Tensor]] = list
    return DataLoader(
        _Batches(loader.dataset.tensors),  # type: ignore[attr-defined]
        batch_size=loader.batch_size,
        sampler=loader.sampler,
        drop_last=loader.drop_last,
        collate_fn=keep,
    )
