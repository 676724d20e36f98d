"""Draws and densities of the flow are those that zuko makes in double precision, for every shape of a net."""

from __future__ import annotations

from typing import Any

import flow_case
import numpy as np
import pytest
import torch
import zuko

from swesbi.networks.affine_maf import BLOCK
from swesbi.networks.flow.training import ConditionalFlow, arrays_of, build_net
from swesbi.networks.settings import EmbeddingSettings, FlowSettings

PARAMETERS, COMPONENTS = 15, 46
EMBEDDING = EmbeddingSettings(hidden_features=48, hidden_layers=2, outputs=16)
SHAPES: dict[str, dict[str, Any]] = {
    "shipped": {"transforms": 8, "hidden_features": 128, "hidden_layers": 2, "embedding": EMBEDDING},
    "one layer": {"transforms": 3, "hidden_features": 64, "hidden_layers": 1, "embedding": EMBEDDING},
    "three layers": {"transforms": 2, "hidden_features": 40, "hidden_layers": 3, "embedding": None},
    "few units": {"transforms": 1, "hidden_features": 5, "hidden_layers": 2, "embedding": None},
    "shallow embedding": {
        "transforms": 2, "hidden_features": 24, "hidden_layers": 1,
        "embedding": EmbeddingSettings(hidden_features=8, hidden_layers=1, outputs=1),
    },
}  # fmt: skip


def built(shape: str, parameters: int = PARAMETERS, components: int = COMPONENTS) -> ConditionalFlow:
    """Return a net whose weights are larger than at the start of a training, so that its maps are curved."""
    torch.manual_seed(1)
    settings = FlowSettings.model_validate(flow_case.TINY.model_dump() | SHAPES[shape])
    net = build_net(settings, parameters, components)
    with torch.no_grad():
        for weight in net.parameters():
            weight.mul_(1.5)
    return net


@pytest.mark.parametrize("parameters", [2, PARAMETERS])
@pytest.mark.parametrize("shape", SHAPES)
def test_maps_and_slopes_are_those_of_the_library(shape: str, parameters: int) -> None:
    net = built(shape, parameters)
    rng = np.random.default_rng(2)
    condition, base = rng.standard_normal(COMPONENTS), rng.standard_normal((3 * BLOCK + 7, parameters))
    flow = arrays_of(net).under(condition)
    with torch.no_grad():
        exact = net.double()(torch.from_numpy(condition)[None].expand(len(base), -1)).transform
        points = exact.inv(torch.from_numpy(base))
        expected, slopes = exact.call_and_ladj(points)
    assert np.abs(points.numpy() - base).max() > 0.3  # the transforms move something
    np.testing.assert_allclose(flow.from_base(base), points.numpy(), rtol=1e-5, atol=1e-5)
    there, log_slope = flow.to_base(points.numpy())
    np.testing.assert_allclose(there, expected.numpy(), rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(log_slope, slopes.numpy(), rtol=1e-5, atol=1e-5)


def test_every_unit_is_evaluated_once() -> None:
    for transform in arrays_of(built("three layers")).transforms:
        passes = transform.passes
        for ends, layer in zip(passes.ends, transform.layers, strict=False):
            assert (np.diff(ends) >= 0).all()
            assert ends[-1] <= len(layer.weight)
        assert passes.ends[0][0] < passes.ends[0][-1]  # not all of them in the first pass


def test_an_embedding_adds_to_the_condition_and_all_transforms_see_it() -> None:
    net = built("shipped")
    condition, x = torch.randn(50, COMPONENTS), torch.randn(50, PARAMETERS)
    embedded = net.embed(condition)
    assert embedded.shape == (50, COMPONENTS + 16)
    torch.testing.assert_close(embedded[:, :COMPONENTS], condition)
    expected = net(condition).log_prob(x)
    moved = torch.cat((condition, embedded[:, COMPONENTS:].flip(0)), dim=1)
    assert (
        float((super(ConditionalFlow, net).forward(moved).log_prob(x) - expected).detach().abs().max()) > 1e-3
    )
    (-expected.mean()).backward()
    assert net.embedding is not None
    assert all(parameter.grad is not None for parameter in net.embedding.parameters())


def test_a_flow_without_an_embedding_is_the_library_s() -> None:
    net = built("three layers")
    condition, x = torch.randn(50, COMPONENTS), torch.randn(50, PARAMETERS)
    bare = zuko.flows.MAF(PARAMETERS, COMPONENTS, transforms=2, hidden_features=(40, 40, 40))
    bare.load_state_dict(net.state_dict())
    torch.testing.assert_close(net(condition).log_prob(x), bare(condition).log_prob(x))
