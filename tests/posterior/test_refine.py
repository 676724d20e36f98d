"""Proposals fitted in the base space of a flow: the map and its density, and what they are worth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import speed_case
import spline_case
from exact_case import SETTINGS
from numpy.typing import NDArray
from scipy.stats import norm

from swesbi.measurement.likelihood import SpeedModel
from swesbi.networks.spline.net import draw_phi, from_base, log_q, to_base
from swesbi.posterior.importance import FlowProposal, Proposal, flow_proposal
from swesbi.posterior.refine import (
    FittedProposal,
    LogitSpace,
    PairProposal,
    StudentProposal,
    refine,
    refined_posterior,
)
from swesbi.prior import JointPriorSettings, draw_prior, in_bounds, log_density

FloatArray = NDArray[np.float64]
PRIORS = ["paper", "calibrated"]
FEW = SETTINGS.refinement.model_copy(update={"max_rounds": 2, "min_efficiency": 0.8})


def proposal(prior: str, count: int = 2000, epochs: int = 12) -> tuple[SpeedModel, FlowProposal]:
    """Return a recording's model, and what a network that trained for a moment makes of the recording."""
    model = speed_case.model(prior=prior)
    return model, flow_proposal(spline_case.trained(prior, count, epochs).spline, model.recording)


def draws_of_prior(prior: JointPriorSettings, count: int) -> FloatArray:
    return draw_prior(prior, count, np.random.default_rng(4))


@pytest.mark.parametrize("prior", PRIORS)
def test_the_maps_to_the_base_space_and_back_are_inverse_to_each_other(prior: str) -> None:
    model, first = proposal(prior)
    phi = draws_of_prior(model.settings.prior, 3000)
    there, _ = to_base(first.flow, first.condition, phi)
    np.testing.assert_allclose(from_base(first.flow, first.condition, there), phi, rtol=1e-4)
    u = np.random.default_rng(5).standard_t(8, (3000, phi.shape[1]))
    back, _ = to_base(first.flow, first.condition, from_base(first.flow, first.condition, u))
    np.testing.assert_allclose(back, u, atol=1e-4)
    assert np.abs(there - u).mean() > 0.3  # so the maps move something


@pytest.mark.parametrize("prior", PRIORS)
def test_the_flow_s_density_is_that_of_its_base_and_the_slope_of_the_map(prior: str) -> None:
    model, first = proposal(prior)
    for phi in (first.draw(500, 1), draws_of_prior(model.settings.prior, 500)):
        u, log_slope = first.place(phi)
        expected = norm.logpdf(u).sum(axis=1) + log_slope
        np.testing.assert_allclose(log_q(first.flow, first.condition, phi), expected, atol=1e-3, rtol=1e-5)


@pytest.mark.parametrize("prior", PRIORS)
def test_draws_of_the_flow_are_standard_normal_in_its_base_space(prior: str) -> None:
    _, first = proposal(prior)
    drawn = draw_phi(first.flow, first.condition[None], 4000, seed=2)[0]
    u, _ = first.place(drawn)
    np.testing.assert_allclose(u.mean(axis=0), 0.0, atol=4.5 / np.sqrt(len(u)))
    np.testing.assert_allclose(np.cov(u.T), np.eye(u.shape[1]), atol=4.5 * np.sqrt(2.0 / len(u)))


def test_the_slope_of_the_map_is_its_derivative() -> None:
    """By differences along one line in the logit of the box, where single precision allows them."""
    model, first = proposal("paper")
    phi, space = first.draw(200, 3), LogitSpace(model.settings.prior)
    eta, log_to_eta = space.place(phi)
    step = 0.02 * np.eye(4)
    sides = [[first.place(space.at(eta + sign * row))[0] for row in step] for sign in (1.0, -1.0)]
    jacobian = np.moveaxis(np.array(sides[0]) - np.array(sides[1]), 0, 2) / 0.04
    found = first.place(phi)[1] - log_to_eta
    difference = found - np.linalg.slogdet(jacobian)[1]
    # a kink of the network within the step makes some differ
    assert np.median(np.abs(difference)) < 0.1 * found.std()


@pytest.mark.parametrize("prior", PRIORS)
def test_a_fitted_proposal_s_density_integrates_to_one(prior: str) -> None:
    model, first = proposal(prior)
    joint, d = model.settings.prior, len(model.settings.prior.names)
    student = StudentProposal(np.full(d, 0.1), 0.4 * np.eye(d))  # narrow: draws of the prior reach its tails
    pair = PairProposal(first, FittedProposal(student, first))
    phi = draws_of_prior(joint, 60_000)
    for part in (first, pair.fitted, pair):
        assert_integrates_to_one(part, phi, joint)
    assert in_bounds(pair.draw(1000, 6), joint).all()


def assert_integrates_to_one(part: Proposal, phi: FloatArray, prior: JointPriorSettings) -> None:
    """Weight draws phi (n, d) of the prior by the density: the mean of q / p is the integral of q."""
    ratio = np.exp(part.log_density(phi) - log_density(phi, prior))
    error = ratio.std() / np.sqrt(len(ratio))
    assert error < 0.1
    assert abs(ratio.mean() - 1.0) < 4.0 * error


def test_refinement_in_the_base_space_makes_a_poor_network_efficient() -> None:
    model, first = proposal("paper", epochs=30)
    refined = refine(model, first, FEW, 1)
    assert 0.01 < refined.efficiency[0] < 0.1
    assert max(refined.efficiency) > 0.4
    assert isinstance(refined.proposal, PairProposal)
    assert isinstance(refined.proposal.fitted, FittedProposal)
    assert refined.proposal.fitted.space is first
    assert_integrates_to_one(
        refined.proposal, draws_of_prior(model.settings.prior, 200_000), model.settings.prior
    )


@dataclass(frozen=True)
class Hidden:
    """A flow's proposal that does not say that it has a base space."""

    flow: FlowProposal

    def draw(self, draws: int, seed: int) -> FloatArray:
        return self.flow.draw(draws, seed)

    def log_density(self, phi: FloatArray) -> FloatArray:
        return self.flow.log_density(phi)


@pytest.mark.slow(minutes=0.5)
def test_with_nuisances_the_base_space_serves_better_than_the_logit() -> None:
    model, first = proposal("calibrated", 8000, 80)
    in_base, in_logit = (refine(model, one, FEW, 1) for one in (first, Hidden(first)))
    assert in_base.efficiency[0] == in_logit.efficiency[0] > 0.01
    assert max(in_base.efficiency) > 2.0 * in_base.efficiency[0]
    assert max(in_base.efficiency) > max(in_logit.efficiency)


def test_of_a_recording_that_a_network_does_not_know_the_logit_is_the_space() -> None:
    model, first = proposal("paper")
    lost = FlowProposal(first.flow, first.condition + 2.0)
    refined = refine(model, lost, FEW, 1)
    assert refined.efficiency[0] < 0.01
    assert isinstance(refined.proposal, PairProposal)
    assert isinstance(refined.proposal.fitted, FittedProposal)
    assert refined.proposal.fitted.space == LogitSpace(model.settings.prior)


def test_a_refined_posterior_has_the_network_s_own_draws_beside_it_and_repeats() -> None:
    model, first = proposal("paper", epochs=30)
    settings = SETTINGS.model_copy(update={"proposal_draws": 2000, "min_effective_draws": 200, "draws": 500})
    exact, efficiency = refined_posterior(model, first, settings, 1, "T")
    again, _ = refined_posterior(model, first, settings, 1, "T")
    other, _ = refined_posterior(model, first, settings, 2, "T")
    assert exact.sampler == "importance"
    assert exact.efficiency > 5.0 * efficiency[0]
    np.testing.assert_array_equal(exact.phi, again.phi)
    assert not np.array_equal(exact.phi, other.phi)
    u, _ = first.place(exact.npe_phi)
    np.testing.assert_allclose(u.std(axis=0), 1.0, atol=4.5 / np.sqrt(2 * len(u)))
