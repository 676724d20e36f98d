"""sbi's training with the passes over the rows done by a lean flow: the same course, several times faster.

Split, order of rows, batches, Adam, clipping, the best epoch and when to stop are sbi's; so are the initial
weights. What differs is rounding.
"""

from __future__ import annotations

import torch
from sbi.neural_nets.estimators import ConditionalDensityEstimator
from sbi.utils.torchutils import assert_all_finite
from torch import Tensor, nn
from torch.nn.utils import clip_grad_norm_
from torch.utils.data import DataLoader

from swesbi.networks.accelerated.flow import LeanFlow
from swesbi.networks.accelerated.weights import FlowWeights, standardise
from swesbi.networks.paper.sbi_trainer import SbiTrainer

Loader = DataLoader[list[Tensor]]


class FastTrainer(SbiTrainer):
    """sbi's NPE-C whose passes over training and validation rows are those of ``_Passes``."""

    _passes: _Passes

    def _train_epoch(self, train_loader: Loader, clip_max_norm: float, loss_args: object) -> float:
        if self.epoch == 0:
            learning_rate = self.optimizer.defaults["lr"]
            self._passes = _Passes(self._neural_net, train_loader, learning_rate)
        with torch.no_grad():
            return self._passes.train(train_loader, clip_max_norm)

    def _validate_epoch(self, val_loader: Loader, loss_args: object) -> float:
        with torch.no_grad():
            return self._passes.validate(val_loader)


class _Passes:
    """Passes over the rows of one training: standardised rows, the lean flow, the optimiser."""

    def __init__(self, net: ConditionalDensityEstimator, loader: Loader, learning_rate: float) -> None:
        theta, z, *_ = loader.dataset.tensors  # type: ignore[attr-defined]
        with torch.no_grad():
            self._theta, self._z, self._constant = standardise(net, theta, z)
        self._weights = FlowWeights(net)
        self._flows: dict[int, LeanFlow] = {}
        self._vector = nn.Parameter(self._weights.blocks.vector)
        self._optimiser = torch.optim.Adam([self._vector], lr=learning_rate, fused=True)

    def train(self, loader: Loader, clip_max_norm: float) -> float:
        """Take a step for each batch, leave the weights in the net, and return the mean loss of the rows."""
        flow, mask = self._flow(loader), self._weights.mask.vector
        self._vector.grad = flow.gradient.vector
        losses = []
        for theta, z in zip(*self._batches(loader), strict=True):
            losses.append(flow.losses(theta, z).sum())
            flow.differentiate()
            flow.gradient.vector.mul_(mask)
            clip_grad_norm_([self._vector], clip_max_norm)
            self._optimiser.step()
        self._weights.write()
        return _mean(losses, loader)

    def validate(self, loader: Loader) -> float:
        """Return the mean loss of the rows."""
        flow = self._flow(loader)
        batches = zip(*self._batches(loader), strict=True)
        return _mean([flow.losses(theta, z).sum() for theta, z in batches], loader)

    def _flow(self, loader: Loader) -> LeanFlow:
        rows = _batch_size(loader)
        if rows not in self._flows:
            self._flows[rows] = LeanFlow(self._weights.blocks, rows, self._constant)
        return self._flows[rows]

    def _batches(self, loader: Loader) -> tuple[Tensor, Tensor]:
        """Return the batches of one pass, theta (n, D, B) and z (n, B, C + 1), in the order of the loader.

        A DataLoader draws a seed for its workers, then its sampler draws the order of the rows.
        """
        torch.empty((), dtype=torch.int64).random_()
        candidates = torch.as_tensor(loader.sampler.indices)  # type: ignore[attr-defined]
        order = candidates[torch.randperm(len(candidates))]
        shape = len(loader), _batch_size(loader)
        rows = order[: shape[0] * shape[1]].to(self._theta.device)
        theta = self._theta[rows].view(*shape, -1).transpose(1, 2).contiguous()
        return theta, self._z[rows].view(*shape, -1)


def _batch_size(loader: Loader) -> int:
    size = loader.batch_size
    assert size is not None, "sbi's loaders have a batch size"
    return size


def _mean(sums: list[Tensor], loader: Loader) -> float:
    """Return the mean over rows from the sums over batches, which must be finite as sbi asks of them."""
    every = torch.stack(sums)
    assert_all_finite(every, "NPE loss")
    return float(every.double().sum()) / (len(sums) * _batch_size(loader))
