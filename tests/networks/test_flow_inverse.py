"""Draws of the flow are those that zuko makes, whatever is left out on the way."""

from __future__ import annotations

import pytest
import spline_case
import torch
import zuko

from swesbi.networks.spline.net import ConditionalFlow, build_net, inverse_transforms

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


def test_an_embedding_adds_to_the_condition_and_all_transforms_see_it() -> None:
    net = build_net(spline_case.TINY, FEATURES, CONTEXT)
    condition, x = torch.randn(50, CONTEXT), torch.randn(50, FEATURES)
    embedded = net.embed(condition)
    assert embedded.shape == (50, CONTEXT + 8)
    torch.testing.assert_close(embedded[:, :CONTEXT], condition)
    expected = net(condition).log_prob(x)
    torch.testing.assert_close(net.of_embedded(embedded).log_prob(x), expected)
    moved = torch.cat((condition, embedded[:, CONTEXT:].flip(0)), dim=1)
    assert float((net.of_embedded(moved).log_prob(x) - expected).detach().abs().max()) > 1e-3
    (-expected.mean()).backward()
    assert all(parameter.grad is not None for parameter in net.embedding.parameters())
    with pytest.raises(ValueError, match="conditional"):
        net()


def test_a_flow_without_an_embedding_is_the_library_s() -> None:
    plain = spline_case.TINY.model_copy(update={"embedding": None})
    condition, x = torch.randn(50, CONTEXT), torch.randn(50, FEATURES)
    net = build_net(plain, FEATURES, CONTEXT)
    bare = zuko.flows.MAF(FEATURES, CONTEXT, transforms=2, hidden_features=(24,))
    bare.load_state_dict(net.state_dict())
    torch.testing.assert_close(net(condition).log_prob(x), bare(condition).log_prob(x))
    assert isinstance(net, ConditionalFlow)


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
