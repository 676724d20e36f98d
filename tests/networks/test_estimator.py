"""Densities and draws of a network in arrays are those of sbi, from the same points of the base space."""

import numpy as np
import pytest
import torch
from inference_case import WIDE_PRIOR, estimator_settings, pool_of_both
from sbi.neural_nets.estimators import ConditionalDensityEstimator
from torch import Tensor

from swesbi.networks.paper.estimator import (
    ROWS_PER_BATCH,
    TrainedEstimator,
    draw_candidates,
    draw_until,
    losses,
)
from swesbi.networks.paper.sbi_trainer import build_net
from swesbi.networks.paper.training import train
from swesbi.networks.paper.weights import arrays_of
from swesbi.networks.training import reproducible
from swesbi.prior import PriorSettings, in_bounds

ROWS, COMPONENTS = 700, 5
SHAPES = [
    {"transforms": 5, "hidden_features": 50},
    {"transforms": 3, "z_score_theta": "none", "z_score_x": "none"},
    {"transforms": 1, "hidden_features": 7, "blocks": 3},
    {"transforms": 4, "hidden_features": 2, "blocks": 1},
]


def sbi_net(**shape: object) -> tuple[ConditionalDensityEstimator, Tensor, Tensor]:
    """Return a network of sbi with weights far from their start, and rows that it is standardised by."""
    with reproducible(3):
        theta, z = 3.0 + 2.0 * torch.randn(ROWS, 3), 0.5 * torch.randn(ROWS, COMPONENTS) - 1.0
        net = build_net(theta, z, estimator_settings(**shape)).eval()
        with torch.no_grad():
            for weight in net.parameters():
                weight += 0.6 * torch.randn_like(weight) / weight.shape[-1] ** 0.5
    return net, theta, z


def estimator_of(net: ConditionalDensityEstimator) -> TrainedEstimator:
    return TrainedEstimator(arrays_of(net), tuple("abcde"), 1, 0.0, True)


@pytest.mark.parametrize("shape", SHAPES)
def test_densities_and_draws_are_those_of_sbi(shape: dict[str, object]) -> None:
    net, theta, z = sbi_net(**shape)
    estimator = estimator_of(net)
    with torch.no_grad():
        expected = net.loss(theta, z).numpy()
        with reproducible(4):
            drawn = net.sample((ROWS,), condition=z[:1])[:, 0].numpy()
    found = losses(estimator, theta.double().numpy(), z.double().numpy())
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-5)
    ours = draw_candidates(estimator, z[:1].double().numpy(), ROWS, 4)[0]
    spread = drawn.std(axis=0)
    np.testing.assert_allclose((ours - drawn) / spread, 0.0, atol=1e-5)
    assert spread.min() > 0.1
    other = draw_candidates(estimator, z[1:2].double().numpy(), ROWS, 4)[0]
    assert (np.abs(other - ours) / spread).max() > 1e-3, "the condition moves something"


def test_drawing_until_enough_is_the_beginning_of_drawing_all() -> None:
    pool, settings = pool_of_both(60), estimator_settings(max_num_epochs=1)
    estimator = train(pool.theta, pool.z, pool.components.names, WIDE_PRIOR, settings, 1).estimator
    everything = draw_candidates(estimator, pool.z_obs[:1], 2 * ROWS_PER_BATCH + 500, 7)[0]

    def drawn(enough: int, prior: PriorSettings = WIDE_PRIOR) -> np.ndarray:
        return draw_until(estimator, pool.z_obs[0], enough, 2 * ROWS_PER_BATCH + 500, prior, 7)

    assert in_bounds(everything, WIDE_PRIOR).sum() < len(everything), "needs some leakage"
    for enough, batches in (
        (1, ROWS_PER_BATCH),
        (ROWS_PER_BATCH, 2 * ROWS_PER_BATCH),
        (10**6, len(everything)),
    ):
        np.testing.assert_array_equal(drawn(enough), everything[:batches])
