"""The lean flow is sbi's flow: losses, gradients, weights there and back, and the course of training."""

import numpy as np
import pytest
import torch
from inference_case import WIDE_PRIOR, estimator_settings, pool_of_both, weights
from sbi.neural_nets.estimators import ConditionalDensityEstimator
from torch import Tensor

from swesbi.networks.paper.accelerated import LeanFlow
from swesbi.networks.paper.pool import Pool
from swesbi.networks.paper.sbi_trainer import build_net
from swesbi.networks.paper.training import TrainedNetwork, train
from swesbi.networks.paper.weights import FlowWeights, standardise
from swesbi.networks.training import reproducible

ROWS = 60
ARCHITECTURES = [
    {},
    {"transforms": 5, "hidden_features": 11, "blocks": 1},
    {"transforms": 1, "blocks": 3},
    {"z_score_theta": "none", "z_score_x": "none"},
]


@pytest.fixture(scope="module")
def pool() -> Pool:
    return pool_of_both()


def rows(dtype: torch.dtype) -> tuple[Tensor, Tensor]:
    generator = torch.Generator().manual_seed(1)
    theta = 1.0 + 2.0 * torch.randn(ROWS, 3, generator=generator, dtype=dtype)
    return theta, torch.randn(ROWS, 7, generator=generator, dtype=dtype) - 0.5


def flow(dtype: torch.dtype = torch.float64, **changes: object) -> ConditionalDensityEstimator:
    """An estimator with weights far from their start, so that every part of it matters."""
    theta, z = rows(torch.float32)
    with reproducible(2):
        net = build_net(theta, z, estimator_settings(**changes)).to(dtype)
        with torch.no_grad():
            for weight in net.parameters():
                weight += 0.4 * torch.randn_like(weight)
    return net


def lean_losses(net: ConditionalDensityEstimator, theta: Tensor, z: Tensor) -> tuple[LeanFlow, Tensor]:
    with torch.no_grad():
        theta, z, constant = standardise(net, theta, z)
        lean = LeanFlow(FlowWeights(net).blocks, len(theta), constant)
        return lean, lean.losses(theta.t(), z)


@pytest.mark.parametrize("changes", ARCHITECTURES)
def test_losses_are_those_of_sbi(changes: dict[str, object]) -> None:
    net, (theta, z) = flow(**changes), rows(torch.float64)
    _, losses = lean_losses(net, theta, z)
    # nflows keeps the constant of the normal density in single precision.
    torch.testing.assert_close(losses, net.loss(theta, z).detach(), rtol=0, atol=1e-6)


def test_losses_are_those_of_sbi_in_single_precision() -> None:
    net, (theta, z) = flow(torch.float32), rows(torch.float32)
    _, losses = lean_losses(net, theta, z)
    torch.testing.assert_close(losses, net.loss(theta, z).detach(), rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("changes", ARCHITECTURES)
def test_gradients_are_those_of_autograd(changes: dict[str, object]) -> None:
    net, (theta, z) = flow(**changes), rows(torch.float64)
    net.loss(theta, z).mean().backward()
    expected = {name: weight.grad for name, weight in net.named_parameters()}
    lean, _ = lean_losses(net, theta, z)
    with torch.no_grad():
        lean.differentiate()
        held = FlowWeights(net)
        held.blocks.vector.copy_(lean.gradient.vector * held.mask.vector)
        for weight in net.parameters():
            weight.zero_()
        held.write()
    for name, weight in net.named_parameters():
        torch.testing.assert_close(weight.detach(), expected[name], rtol=1e-9, atol=1e-12, msg=name)


def test_weights_come_back_as_they_were_and_masked_ones_stay() -> None:
    net = flow(transforms=3)
    before = {name: value.clone() for name, value in net.state_dict().items()}
    held = FlowWeights(net)
    held.write()
    assert all(torch.equal(value, before[name]) for name, value in net.state_dict().items())
    held.blocks.vector.add_(1.0)
    held.write()
    for name, value in net.named_parameters():
        mask = dict(net.named_buffers()).get(name.replace("weight", "mask"))
        moved = torch.ones_like(value) if mask is None else mask
        torch.testing.assert_close(value.detach() - before[name], moved, rtol=0, atol=1e-12, msg=name)
    count = sum(int(v.sum()) for n, v in net.named_buffers() if n.endswith("mask"))
    free = sum(v.numel() for n, v in net.named_parameters() if "context" in n or n.endswith("bias"))
    assert int(held.mask.vector.sum()) == count + free


def test_written_weights_give_the_losses_of_the_lean_flow() -> None:
    net, (theta, z) = flow(transforms=3), rows(torch.float64)
    held = FlowWeights(net)
    with torch.no_grad():
        held.blocks.vector.mul_(0.7)
        held.write()
        x, ones, constant = standardise(net, theta, z)
        losses = LeanFlow(held.blocks, ROWS, constant).losses(x.t(), ones)
    torch.testing.assert_close(losses, net.loss(theta, z).detach(), rtol=0, atol=1e-6)


def course(pool: Pool, procedure: str, seed: int = 11, **changes: object) -> TrainedNetwork:
    settings = estimator_settings(procedure=procedure, **changes)
    return train(pool.theta, pool.z, pool.components.names, WIDE_PRIOR, settings, seed)


def assert_close(fast: TrainedNetwork, sbi: TrainedNetwork, within: float) -> None:
    expected = weights(sbi.estimator)
    for name, values in weights(fast.estimator).items():
        np.testing.assert_allclose(values, expected[name], rtol=0, atol=within, err_msg=name)


@pytest.mark.parametrize("changes", [{}, {"batch_size": 2000}, {"clip_max_norm": 0.5, "batch_size": 130}])
def test_the_course_of_training_is_that_of_sbi(pool: Pool, changes: dict[str, object]) -> None:
    """Same split, order, batches, optimiser and clipping: only rounding may differ, and it grows slowly."""
    fast = course(pool, "fast", max_num_epochs=3, **changes)
    sbi = course(pool, "sbi", max_num_epochs=3, **changes)
    np.testing.assert_allclose(fast.training, sbi.training, rtol=0, atol=2e-4)
    assert_close(fast, sbi, 5e-3)


def test_one_step_is_that_of_sbi(pool: Pool) -> None:
    """A batch of all training rows: two epochs are two steps."""
    changes: dict[str, object] = {"batch_size": 10_000, "learning_rate": 0.01, "max_num_epochs": 1}
    fast, sbi = course(pool, "fast", **changes), course(pool, "sbi", **changes)
    assert_close(fast, sbi, 1e-4)


def test_fast_training_repeats_to_the_bit_and_follows_its_seed(pool: Pool) -> None:
    one, again, other = (weights(course(pool, "fast", seed).estimator) for seed in (5, 5, 6))
    np.testing.assert_equal(one, again)
    assert (one["first"] != other["first"]).any()


@pytest.mark.parametrize("procedure", ["sbi", "fast"])
def test_a_loss_that_is_not_finite_is_an_error(pool: Pool, procedure: str) -> None:
    with pytest.raises(ValueError, match="NPE loss"):
        course(pool, procedure, learning_rate=1e30)
