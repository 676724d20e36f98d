"""Proposals fitted in the base space of a flow: the map and its density, and what they are worth."""

from __future__ import annotations

from dataclasses import dataclass, replace

import flow_case
import numpy as np
import pytest
import speed_case
from exact_case import SETTINGS, weigh
from numpy.typing import NDArray
from scipy.stats import norm

from swesbi.networks.flow.trained import FlowProposal, flow_proposal
from swesbi.posterior.adaptive import adaptive_rounds
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.fitted import FittedProposal, StudentProposal, fit_in_nearest, placed_in
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.importance import Proposal
from swesbi.posterior.settings import asking
from swesbi.posterior.space import LogitSpace
from swesbi.prior import SimulatedPrior, draw_prior, in_bounds, log_centre, log_density

FloatArray = NDArray[np.float64]
PRIORS = ["paper", "calibrated"]


def proposal(prior: str, count: int = 2000, epochs: int = 12) -> tuple[HeartModel, FlowProposal]:
    """Return the model of a recording's heart, and what a network that trained for a moment makes of it."""
    model = speed_case.model(prior=prior)
    return HeartModel(model), flow_proposal(
        flow_case.trained(prior, count, epochs).estimator, model.recording
    )


def draws_of_prior(prior: SimulatedPrior, count: int) -> FloatArray:
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
    step = 0.02 * np.eye(3)
    sides = [[first.place(space.at(eta + sign * row))[0] for row in step] for sign in (1.0, -1.0)]
    jacobian = np.moveaxis(np.array(sides[0]) - np.array(sides[1]), 0, 2) / 0.04
    found = first.place(phi)[1] - log_to_eta
    difference = found - np.linalg.slogdet(jacobian)[1]
    # a kink of the network within the step makes some differ
    assert np.median(np.abs(difference)) < 0.1 * found.std()


@pytest.mark.parametrize("prior", PRIORS)
def test_a_fitted_proposal_s_density_integrates_to_one(prior: str) -> None:
    """Of a recording of the prior's centre, so that draws of the prior reach all of the proposal."""
    model, first = proposal(prior)
    hearts, d = model.settings.prior, len(model.settings.prior.names)
    speeds = model.speeds.predict(log_centre(model.prior)[None]).speed_m_s[0]
    first = flow_proposal(first.flow, replace(model.speeds.recording, speed_m_s=speeds))
    student = StudentProposal(np.full(d, 0.1), 0.4 * np.eye(d))  # narrow: draws of the prior reach its tails
    fitted, phi = FittedProposal(student, first), draws_of_prior(hearts, 60_000)
    for part in (first, fitted):
        assert_integrates_to_one(part, phi, hearts)
    assert in_bounds(fitted.draw(1000, 6), hearts).all()


def assert_integrates_to_one(part: Proposal, phi: FloatArray, prior: SimulatedPrior) -> None:
    """Weight draws phi (n, d) of the prior by the density: the mean of q / p is the integral of q."""
    ratio = np.exp(part.log_density(phi) - log_density(phi, prior))
    error = ratio.std() / np.sqrt(len(ratio))
    assert error < 0.1
    assert abs(ratio.mean() - 1.0) < 4.0 * error


@pytest.mark.parametrize(
    ("prior", "count", "epochs", "gain"), [("paper", 2000, 9, 4.0), ("calibrated", 4000, 30, 2.0)]
)
def test_rounds_make_a_poor_network_efficient(prior: str, count: int, epochs: int, gain: float) -> None:
    model, first = proposal(prior, count, epochs)
    rounds = list(adaptive_rounds(model, asking(SETTINGS, 400), 1, first))
    assert rounds[-1].reliable
    alone = weigh(model, rounds[-1].proposal(), 2000, 0.1, 2)
    assert alone.efficiency > gain * rounds[0].weighted.efficiency > 0.0


def test_a_network_that_knows_nothing_of_a_recording_is_left_behind() -> None:
    model, first = proposal("paper")
    lost = FlowProposal(first.flow, first.condition + 2.0)
    rounds = list(adaptive_rounds(model, SETTINGS, 1, lost))
    assert rounds[0].weighted.efficiency < 0.01
    assert rounds[-1].reliable


def test_a_posterior_has_the_network_s_own_draws_beside_it_and_repeats() -> None:
    model, first = proposal("paper", epochs=9)
    settings = asking(SETTINGS, 300).model_copy(update={"draws": 500})
    exact, drawn = exact_posterior(model, first, settings, 1, "T")
    again, _ = exact_posterior(model, first, settings, 1, "T")
    other, _ = exact_posterior(model, first, settings, 2, "T")
    assert exact.sampler == "importance"
    assert exact.efficiency > 2.0 * drawn.efficiency[0]
    np.testing.assert_array_equal(exact.phi, again.phi)
    assert not np.array_equal(exact.phi, other.phi)
    u, _ = first.place(model.points(exact.proposal_phi))
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
    placed = [placed_in(space, model.points(weighted.phi)) for space in (FarSpace(logit), logit)]
    fitted = fit_in_nearest(placed, weighted.log_weight)
    assert fitted.space is logit
