"""The stage: recording, noise and network in, a posterior with its reliability out."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import pytest
import speed_case
from exact_case import fitted, weigh
from exact_study import EXACT, write_inputs

from swesbi.artefacts import Origin, load
from swesbi.measurement.likelihood import read_speed_model
from swesbi.networks.flow.files import load_flow
from swesbi.networks.flow.flow import FlowProposal, flow_proposal
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.result import read_exact_posterior
from swesbi.posterior.truncated import POSTERIOR, read_posterior
from swesbi.prior import in_bounds
from swesbi.study.stages import exact as stage


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return write_inputs(tmp_path_factory.mktemp("exact"))


def posterior(inputs: dict[str, Path], path: Path, seed: int = 1) -> Path:
    settings = stage.ExactPosteriorSettings(model=speed_case.settings(), exact=EXACT)
    stage.exact_posterior(**inputs, posterior=path, settings=settings, origin=Origin(seed, "T", "c"))
    return path


def test_the_networks_density_weights_as_a_known_proposal_does(inputs: dict[str, Path]) -> None:
    """A wrong density or Jacobian of the network, or a wrong integral, would move the evidence."""
    model = read_speed_model(inputs["observation"], inputs["noise"], speed_case.settings())
    network = flow_proposal(load_flow(inputs["estimator"])[0], model.recording)
    found, expected = (
        weigh(each, proposal, 24_000, 0.1, 1)
        for each, proposal in ((HeartModel(model), network), (model, fitted(model)))
    )
    error = 4.0 * np.hypot(found.log_evidence_se, expected.log_evidence_se)
    assert error < 1.2
    assert found.log_evidence == pytest.approx(expected.log_evidence, abs=error)


def test_the_stage_writes_a_posterior_and_says_what_gave_it(
    inputs: dict[str, Path], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO, logger="swesbi"):
        path = posterior(inputs, tmp_path / "posterior.h5")
    exact = read_exact_posterior(path)
    assert f"draws by {exact.sampler}" in caplog.text
    assert all(reason in caplog.text for reason in exact.reasons)
    assert exact.phi.shape == (EXACT.draws, 4)
    assert in_bounds(exact.phi, speed_case.settings().prior).all()
    common, provenance = read_posterior(path), load(path, POSTERIOR)[1]
    flow, _ = load_flow(inputs["estimator"])
    model = read_speed_model(inputs["observation"], inputs["noise"], speed_case.settings())
    np.testing.assert_allclose(common.z_obs, flow.conditioner.condition(model.recording))
    assert common.component_names == flow.components
    assert (provenance.kind, provenance.subject) == (POSTERIOR, "T")


def test_the_stage_repeats_to_the_byte_and_depends_on_the_seed(
    inputs: dict[str, Path], tmp_path: Path
) -> None:
    first, again, other = (
        posterior(inputs, tmp_path / f"{name}.h5", seed).read_bytes()
        for name, seed in (("first", 1), ("again", 1), ("other", 2))
    )
    assert first == again
    assert first != other


def test_a_proposal_is_the_flow_at_one_conditioning_vector(inputs: dict[str, Path]) -> None:
    flow, _ = load_flow(inputs["estimator"])
    model = speed_case.model()
    proposal = flow_proposal(flow, model.recording)
    assert isinstance(proposal, FlowProposal)
    heart = proposal.draw(300, 5)
    assert heart.shape == (300, 3)
    np.testing.assert_array_equal(heart, proposal.draw(300, 5))
    assert np.isfinite(proposal.log_density(heart)).all()
