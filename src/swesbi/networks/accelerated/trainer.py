"""sbi's training with the passes over the rows done by a lean flow: the same course, several times faster.

Split, order of rows, batches, Adam, clipping, the best epoch and when to stop are sbi's; so are the initial
weights. What differs is rounding.
"""

from __future__ import annotations

import torch
from sbi.utils.torchutils import assert_all_finite
from torch import Tensor, nn
from torch.nn.utils import clip_grad_norm_
from torch.utils.data import DataLoader

from swesbi.networks.accelerated.flow import LeanFlow
from swesbi.networks.paper.sbi_trainer import SbiTrainer
from swesbi.networks.paper.weights import FlowWeights, standardise

Loader = DataLoader[list[Tensor]]


class FastTrainer(SbiTrainer):
    """sbi's NPE-C whose passes over training and validation rows are those of a lean flow."""

    @torch.no_grad()
    def _train_epoch(self, train_loader: Loader, clip_max_norm: float, loss_args: object) -> float:
        """Take a step for each batch, leave the weights in the net, and return the mean loss of the rows."""
        if self.epoch == 0:
            self._begin(train_loader)
        flow, mask = self._flow(train_loader), self._weights.mask.vector
        self._vector.grad = flow.gradient.vector
        losses = []
        for theta, z in zip(*self._batches(train_loader), strict=True):
            losses.append(flow.losses(theta, z).sum())
            flow.differentiate()
            flow.gradient.vector.mul_(mask)
            clip_grad_norm_([self._vector], clip_max_norm)
            self._steps.step()
        self._weights.write()
        return _mean(losses, train_loader)

    @torch.no_grad()
    def _validate_epoch(self, val_loader: Loader, loss_args: object) -> float:
        flow, batches = self._flow(val_loader), zip(*self._batches(val_loader), strict=True)
        return _mean([flow.losses(theta, z).sum() for theta, z in batches], val_loader)

    def _begin(self, loader: Loader) -> None:
        """Standardise the rows, and put the weights where they are trained."""
        theta, z, *_ = loader.dataset.tensors  # type: ignore[attr-defined]
        self._rows = standardise(self._neural_net, theta, z)
        self._weights = FlowWeights(self._neural_net)
        self._flows: dict[int, LeanFlow] = {}
        self._vector = nn.Parameter(self._weights.blocks.vector)
        self._steps = torch.optim.Adam([self._vector], lr=self.optimizer.defaults["lr"], fused=True)

    def _flow(self, loader: Loader) -> LeanFlow:
        rows = _batch_size(loader)
        if rows not in self._flows:
            self._flows[rows] = LeanFlow(self._weights.blocks, rows, self._rows[2])
        return self._flows[rows]

    def _batches(self, loader: Loader) -> tuple[Tensor, Tensor]:
        """Return the batches of one pass, theta (n, D, B) and z (n, B, C + 1), in the order of the loader.

        A DataLoader draws a seed for its workers, then its sampler draws the order of the rows.
        """
        torch.empty((), dtype=torch.int64).random_()
        candidates = torch.as_tensor(loader.sampler.indices)  # type: ignore[attr-defined]
        order = candidates[torch.randperm(len(candidates))]
        shape = len(loader), _batch_size(loader)
        theta, z, _ = self._rows
        rows = order[: shape[0] * shape[1]].to(theta.device)
        return theta[rows].view(*shape, -1).transpose(1, 2).contiguous(), z[rows].view(*shape, -1)


def _batch_size(loader: Loader) -> int:
    size = loader.batch_size
    assert size is not None, "sbi's loaders have a batch size"
    return size


def _mean(sums: list[Tensor], loader: Loader) -> float:
    """Return the mean over rows from the sums over batches, which must be finite as sbi asks of them."""
    every = torch.stack(sums)
    assert_all_finite(every, "NPE loss")
    return float(every.double().sum()) / (len(sums) * _batch_size(loader))
