"""Draws of sbi's flow with every hidden unit evaluated once are those that sbi makes."""

from __future__ import annotations

from typing import Any

import pytest
import torch
from nflows.transforms.autoregressive import MaskedAffineAutoregressiveTransform
from sbi.neural_nets import posterior_nn

from swesbi.networks.paper.maf import SequentialInverse, for_drawing

ROWS, CONTEXT = 300, 7


def estimator(features: int, **options: Any) -> Any:  # noqa: ANN401
    torch.manual_seed(1)
    theta = torch.randn(ROWS, features) * 3.0
    condition = torch.randn(ROWS, CONTEXT)
    build = posterior_nn("maf", hidden_features=21, num_transforms=3, **options)
    return build(theta, condition).eval()


@pytest.mark.parametrize("features", [2, 3, 4])
def test_draws_are_those_of_the_library(features: int) -> None:
    net = estimator(features)
    fast, row = for_drawing(net), torch.randn(1, CONTEXT)
    assert sum(isinstance(module, SequentialInverse) for module in fast.modules()) == 3
    found = []
    for one in (net, fast):
        torch.manual_seed(5)
        with torch.no_grad():
            found.append(one.sample((ROWS,), condition=row))
    torch.testing.assert_close(found[0], found[1], rtol=0.0, atol=1e-5)


def test_inverse_has_the_determinant_of_the_library_and_undoes_the_transform() -> None:
    transform = next(
        one for one in estimator(3).modules() if isinstance(one, MaskedAffineAutoregressiveTransform)
    )
    fast, base, context = SequentialInverse(transform), torch.randn(ROWS, 3), torch.randn(ROWS, CONTEXT)
    with torch.no_grad():
        theta, log_determinant = fast.inverse(base, context)
        torch.testing.assert_close(log_determinant, transform.inverse(base, context)[1], rtol=0, atol=1e-5)
        again, forward = fast(theta, context)
    torch.testing.assert_close(again, base, rtol=0.0, atol=1e-5)
    torch.testing.assert_close(forward, -log_determinant, rtol=0.0, atol=1e-5)


def test_other_transforms_stay_as_they_are() -> None:
    fast = for_drawing(estimator(3, use_batch_norm=True))
    assert not any(isinstance(module, SequentialInverse) for module in fast.modules())
