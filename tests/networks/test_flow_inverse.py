"""Draws of the flow are those that zuko makes, whatever is left out on the way."""

from __future__ import annotations

import pytest
import torch
import zuko

from swesbi.networks.spline.net import inverse_transforms

FEATURES, CONTEXT = 4, 7


def nets() -> dict[str, zuko.flows.Flow]:
    torch.manual_seed(1)
    shape = {"transforms": 3, "hidden_features": (40, 24)}
    return {
        "nsf": zuko.flows.NSF(FEATURES, CONTEXT, bins=5, **shape),
        "maf": zuko.flows.MAF(FEATURES, CONTEXT, **shape),
        "permuted": zuko.flows.NSF(FEATURES, CONTEXT, bins=5, randperm=True, **shape),
        "two passes": zuko.flows.NSF(FEATURES, CONTEXT, bins=5, passes=2, **shape),
    }


@pytest.mark.parametrize("name", nets())
def test_inverse_is_that_of_the_library(name: str) -> None:
    net, condition, base = nets()[name], torch.randn(200, CONTEXT), 2.0 * torch.randn(200, FEATURES)
    with torch.no_grad():
        expected, found = net(condition).transform.inv(base), base
        for inverse in inverse_transforms(net):
            found = inverse(found, condition)
    assert float((expected - base).abs().max()) > 0.1  # the transforms move something
    torch.testing.assert_close(found, expected, rtol=0.0, atol=3e-6)


def test_inverse_undoes_the_transform() -> None:
    net, condition, x = nets()["nsf"], torch.randn(200, CONTEXT), torch.randn(200, FEATURES)
    with torch.no_grad():
        found = net(condition).transform(x)
        for inverse in inverse_transforms(net):
            found = inverse(found, condition)
    torch.testing.assert_close(found, x, rtol=0.0, atol=1e-4)


def test_every_unit_is_evaluated_once() -> None:
    net = nets()["nsf"]
    for inverse, transform in zip(inverse_transforms(net), reversed(net.transform.transforms), strict=True):
        layers = zip(*(one.layers for one in inverse.passes), strict=True)
        linear = [layer for layer in transform.hyper if hasattr(layer, "mask")]
        for units, layer in zip(layers, linear, strict=True):
            rows = torch.cat([part.rows for part in units])
            assert len(rows.unique()) == len(rows) <= layer.out_features


def test_other_flows_are_refused() -> None:
    with pytest.raises(ValueError, match="masked autoregressive"):
        inverse_transforms(zuko.flows.NICE(FEATURES, CONTEXT))
    with pytest.raises(ValueError, match="rectified linear units"):
        inverse_transforms(zuko.flows.MAF(FEATURES, CONTEXT, activation=torch.nn.ELU))
