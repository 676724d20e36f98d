"""The posterior of a subject: recording, noise and network in, draws with their reliability out."""

from __future__ import annotations

import logging
from pathlib import Path

import flow_case
import numpy as np
import pytest
import speed_case
from exact_case import SMALL, fitted, weigh
from recordings import RECORDING, levels_of, make_samples

from swesbi.artefacts import Provenance
from swesbi.measurement.likelihood import speed_model
from swesbi.networks.flow.trained import TrainedFlow, flow_proposal
from swesbi.posterior.exact import posterior_of_subject
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.truncated import Posterior
from swesbi.prior import in_bounds
from swesbi.recording.ingest import ingest
from swesbi.recording.noise.cohort import CohortNoise, fit_cohort
from swesbi.recording.observation import Observation

Inputs = tuple[Observation, CohortNoise, TrainedFlow]


@pytest.fixture(scope="module")
def inputs() -> Inputs:
    """The observation of one subject, its noise and the smallest network."""
    speeds = speed_case.model().recording.speed_m_s
    samples = make_samples(speeds, repeat_sd=0.04, sample_sd=0.08, seed=1)
    observed = ingest(samples, speed_case.CONTEXT, RECORDING, 100)
    return observed, fit_cohort({"T": levels_of(samples)}, {}), flow_case.trained(epochs=30).estimator


def posterior(inputs: Inputs, seed: int = 1) -> ExactPosterior:
    return posterior_of_subject(*inputs, model=speed_case.settings(), exact=SMALL, seed=seed)


def test_the_networks_density_weights_as_a_known_proposal_does(inputs: Inputs) -> None:
    """A wrong density or Jacobian of the network, or a wrong integral, would move the evidence."""
    observed, noise, flow = inputs
    model = speed_model(observed, noise, speed_case.settings())
    network = flow_proposal(flow, model.recording)
    found, expected = (
        weigh(each, proposal, 24_000, 0.1, 1)
        for each, proposal in ((HeartModel(model), network), (model, fitted(model)))
    )
    error = 4.0 * np.hypot(found.log_evidence_se, expected.log_evidence_se)
    assert error < 1.2
    assert found.log_evidence == pytest.approx(expected.log_evidence, abs=error)


def test_the_stage_writes_a_posterior_and_says_what_gave_it(
    inputs: Inputs, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "posterior.h5"
    with caplog.at_level(logging.INFO, logger="swesbi"):
        posterior(inputs).write(path, Provenance("", "T"))
    exact = ExactPosterior.read(path)
    assert f"draws by {exact.sampler}" in caplog.text
    assert all(reason in caplog.text for reason in exact.reasons)
    assert exact.phi.shape == (SMALL.draws, 4)
    assert in_bounds(exact.phi, speed_case.settings().prior).all()
    common, (observed, noise, flow) = Posterior.read(path), inputs
    model = speed_model(observed, noise, speed_case.settings())
    np.testing.assert_allclose(common.z_obs, flow.conditioner.condition(model.recording))
    assert common.component_names == flow.components


def test_the_stage_repeats_to_the_byte_and_depends_on_the_seed(inputs: Inputs, tmp_path: Path) -> None:
    found = []
    for number, seed in enumerate((1, 1, 2)):
        path = tmp_path / f"{number}.h5"
        posterior(inputs, seed).write(path, Provenance("", "T"))
        found.append(path.read_bytes())
    first, again, other = found
    assert first == again
    assert first != other
