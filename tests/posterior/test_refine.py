"""Proposals fitted in the base space of a flow: the map and its density, and what they are worth."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
import speed_case
import spline_case
from exact_case import SETTINGS
from numpy.typing import NDArray
from scipy.stats import norm

from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings
from swesbi.networks.spline.flow import FlowProposal, flow_proposal
from swesbi.posterior.importance import Proposal, weigh
from swesbi.posterior.refine import (
    LOST_EFFICIENCY,
    FittedProposal,
    PairProposal,
    fit_in_nearest,
    refine,
    refined_posterior,
)
from swesbi.posterior.space import LogitSpace
from swesbi.posterior.student import StudentProposal, fitted_mixture
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
    there, _ = first.place(phi)
    np.testing.assert_allclose(first.at(there), phi, rtol=1e-4)
    u = np.random.default_rng(5).standard_t(8, (3000, phi.shape[1]))
    back, _ = first.place(first.at(u))
    np.testing.assert_allclose(back, u, atol=1e-4)
    assert np.abs(there - u).mean() > 0.3  # so the maps move something


@pytest.mark.parametrize("prior", PRIORS)
def test_the_flow_s_density_is_that_of_its_base_and_the_slope_of_the_map(prior: str) -> None:
    model, first = proposal(prior)
    for phi in (first.draw(500, 1), draws_of_prior(model.settings.prior, 500)):
        u, log_slope = first.place(phi)
        expected = norm.logpdf(u).sum(axis=1) + log_slope
        np.testing.assert_allclose(first.log_density(phi), expected, atol=1e-9)


@pytest.mark.parametrize("prior", PRIORS)
def test_draws_of_the_flow_are_standard_normal_in_its_base_space(prior: str) -> None:
    _, first = proposal(prior)
    drawn = first.draw(4000, seed=2)
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


def two_heaps(count: int, seed: int) -> FloatArray:
    """Draw eta (count, 3) from two normal heaps, the first with a share of 0.7."""
    rng = np.random.default_rng(seed)
    first = rng.random(count) < 0.7
    centres = np.where(first[:, None], [[-3.0, 0.0, 0.0]], [[3.0, 1.0, 0.0]])
    return np.asarray(centres + 0.5 * rng.standard_normal((count, 3)))


def test_a_fitted_mixture_has_the_heaps_of_the_draws_and_a_density_of_its_draws() -> None:
    mixture = fitted_mixture(two_heaps(3000, 1), np.zeros(3000), seed=2)
    assert len(mixture.parts) > 1
    drawn = mixture.draw(4000, np.random.default_rng(3))
    left = drawn[:, 0] < 0.0
    assert left.mean() == pytest.approx(0.7, abs=0.02)
    np.testing.assert_allclose(drawn[left].mean(axis=0), [-3.0, 0.0, 0.0], atol=0.1)
    wide = StudentProposal(np.zeros(3), np.diag([9.0, 1.0, 1.0]))
    points = wide.draw(100_000, np.random.default_rng(4))
    ratio = np.exp(mixture.log_density(points) - wide.log_density(points))
    assert abs(ratio.mean() - 1.0) < 4.0 * ratio.std() / np.sqrt(len(ratio)) < 0.05


def test_weights_count_in_a_mixture_and_few_effective_draws_give_one_part() -> None:
    eta = two_heaps(3000, 1)
    left_only = np.where(eta[:, 0] < 0.0, 0.0, -30.0)
    drawn = fitted_mixture(eta, left_only, seed=2).draw(2000, np.random.default_rng(3))
    assert (drawn[:, 0] < 0.0).mean() > 0.99
    assert len(fitted_mixture(eta[:50], np.zeros(50), seed=2).parts) == 1


@dataclass
class Counting:
    """A model that notes how many likelihoods each call asked for."""

    model: SpeedModel
    calls: list[int] = field(default_factory=list)

    @property
    def settings(self) -> SpeedModelSettings:
        return self.model.settings

    def log_likelihood(self, phi: FloatArray) -> FloatArray:
        self.calls.append(len(phi))
        return self.model.log_likelihood(phi)


def test_an_inefficient_proposal_is_drawn_from_more_often() -> None:
    model, first = proposal("paper")
    settings = FEW.model_copy(update={"draws": 1000, "most_draws": 5000, "effective_draws": 150})
    counting = Counting(model)
    efficiency = refine(counting, first, settings, 1).efficiency
    wanted = [int(np.clip(150 / one, 1000, 5000)) for one in efficiency[:-1]]
    assert counting.calls == [1000, *wanted]
    assert max(counting.calls) > 1000


def assert_integrates_to_one(part: Proposal, phi: FloatArray, prior: JointPriorSettings) -> None:
    """Weight draws phi (n, d) of the prior by the density: the mean of q / p is the integral of q."""
    ratio = np.exp(part.log_density(phi) - log_density(phi, prior))
    error = ratio.std() / np.sqrt(len(ratio))
    assert error < 0.1
    assert abs(ratio.mean() - 1.0) < 4.0 * error


def test_refinement_in_the_base_space_makes_a_poor_network_efficient() -> None:
    model, first = proposal("paper", epochs=18)
    refined = refine(model, first, FEW, 1)
    assert 0.01 < refined.efficiency[0] < 0.1
    assert max(refined.efficiency) > 0.4
    assert isinstance(refined.proposal, PairProposal)
    assert isinstance(refined.proposal.fitted, FittedProposal)
    assert refined.proposal.fitted.space is first
    assert_integrates_to_one(
        refined.proposal, draws_of_prior(model.settings.prior, 200_000), model.settings.prior
    )


def test_with_nuisances_refinement_makes_a_poor_network_more_efficient() -> None:
    model, first = proposal("calibrated", 4000, 30)
    refined = refine(model, first, FEW, 1)
    assert refined.efficiency[0] > 0.002
    assert max(refined.efficiency) > 2.0 * refined.efficiency[0]


@pytest.mark.parametrize("rounds", [1, 2])
def test_a_network_that_knows_nothing_of_a_recording_is_left_aside(rounds: int) -> None:
    model, first = proposal("paper")
    lost = FlowProposal(first.flow, first.condition + 2.0)
    refined = refine(model, lost, FEW.model_copy(update={"max_rounds": rounds}), 1)
    assert refined.efficiency[0] < LOST_EFFICIENCY
    assert max(refined.efficiency) > 0.3
    assert isinstance(refined.proposal, FittedProposal)
    assert refined.proposal.space == LogitSpace(model.settings.prior)


def test_a_refined_posterior_has_the_network_s_own_draws_beside_it_and_repeats() -> None:
    model, first = proposal("paper", epochs=18)
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


def test_draws_too_far_apart_for_a_covariance_leave_a_space_out() -> None:
    """A map that overflows places draws so far apart that no covariance of theirs is positive definite."""

    @dataclass(frozen=True)
    class FarSpace:
        logit: LogitSpace

        def place(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
            u, log_slope = self.logit.place(phi)
            u[:, 0] = 1e30 * u[:, 1]
            return u, log_slope

        def at(self, u: FloatArray) -> FloatArray:
            return self.logit.at(u)

    model, first = proposal("paper")
    logit = LogitSpace(model.settings.prior)
    weighted = weigh(model, first, 2000, 0.1, 1)
    fitted = fit_in_nearest([FarSpace(logit), logit], weighted.phi, weighted.log_weight, 1)
    assert fitted.space is logit
