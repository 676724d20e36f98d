"""A proposal for one parameter more: a product of densities, and the weights that follow from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import speed_case
import spline_case
from exact_case import SETTINGS, weigh
from scipy.stats import multivariate_normal, norm

from swesbi.base.arrays import FloatArray
from swesbi.heart.physiology import VOLUME_FACTOR
from swesbi.measurement.clinical import with_stressed_volume
from swesbi.networks.flow.flow import FlowProposal, flow_proposal
from swesbi.posterior.adaptive import adaptive_rounds
from swesbi.posterior.extended import ExtendedProposal, OnePrior, extended_proposal
from swesbi.posterior.importance import HasPrior
from swesbi.posterior.space import LogitSpace, Space
from swesbi.prior import JointPriorSettings, draw_prior, in_bounds, level, log_density, quantile

FACTOR = speed_case.shipped().clinical.stressed_volume_factor


def flow() -> tuple[JointPriorSettings, FlowProposal]:
    """Return the prior with the volume's factor, and a flow of the others that trained for a moment."""
    model = speed_case.model(prior="calibrated")
    known = flow_proposal(spline_case.trained("calibrated", 2000, 12).flow, model.recording)
    return with_stressed_volume(model.settings.prior, FACTOR), known


def test_its_density_is_the_product() -> None:
    prior, known = flow()
    made = extended_proposal(known, prior, VOLUME_FACTOR)
    assert made.column == prior.names.index(VOLUME_FACTOR) == 12
    phi = np.concatenate([made.draw(300, 1), draw_prior(prior, 300, np.random.default_rng(2))])
    factor, others = phi[:, [12]], np.delete(phi, 12, axis=1)
    expected = known.log_density(others) + log_density(factor, OnePrior(FACTOR))
    np.testing.assert_allclose(made.log_density(phi), expected, rtol=1e-12)


def test_its_density_integrates_to_one() -> None:
    """Over draws of itself, p / q has the mean one for any density p within: here the prior's own factor."""
    prior, known = flow()
    made = extended_proposal(known, prior, VOLUME_FACTOR)
    narrow = OnePrior(FACTOR.model_copy(update={"log_sd": 0.08}))
    phi = made.draw(40_000, 3)
    other = known.log_density(np.delete(phi, 12, axis=1)) + log_density(phi[:, [12]], narrow)
    ratio = np.exp(other - made.log_density(phi))
    assert ratio.mean() == pytest.approx(1.0, abs=4.0 * ratio.std() / 200.0)


def test_draws_have_the_factor_of_the_prior_and_the_others_of_the_flow() -> None:
    prior, known = flow()
    made = extended_proposal(known, prior, VOLUME_FACTOR)
    phi = made.draw(4000, 4)
    assert in_bounds(phi, prior).all()
    score = norm.ppf(level(phi[:, [12]], OnePrior(FACTOR)))[:, 0]
    assert abs(score.mean()) < 0.07
    assert score.std() == pytest.approx(1.0, abs=0.05)
    u, _ = known.place(np.delete(phi, 12, axis=1))
    assert np.abs(u.mean(axis=0)).max() < 0.08
    assert np.abs(np.corrcoef(u[:, 0], score)[0, 1]) < 0.06


def test_the_base_space_and_back_are_inverse_and_the_slope_is_the_derivative() -> None:
    prior, known = flow()
    made = extended_proposal(known, prior, VOLUME_FACTOR)
    assert isinstance(made, Space)
    phi = made.draw(500, 5)
    u, log_slope = made.place(phi)
    np.testing.assert_allclose(made.at(u), phi, rtol=1e-3)
    np.testing.assert_allclose(made.at(u)[:, 12], phi[:, 12], rtol=1e-9)
    known_slope = known.place(np.delete(phi, 12, axis=1))[1]
    step = 1e-6
    moved = [
        np.concatenate([phi[:, :12], phi[:, [12]] + side, phi[:, 13:]], axis=1) for side in (-step, step)
    ]
    derivative = (made.place(moved[1])[0][:, 12] - made.place(moved[0])[0][:, 12]) / (2.0 * step)
    np.testing.assert_allclose(log_slope - known_slope, np.log(derivative), atol=1e-5)


def test_points_far_out_stay_inside_the_bounds() -> None:
    prior, known = flow()
    made = extended_proposal(known, prior, VOLUME_FACTOR)
    u = np.zeros((2, len(prior.names)))
    u[:, 12] = -40.0, 40.0
    factor = made.at(u)[:, 12]
    assert FACTOR.low < factor[0] < factor[1] < FACTOR.high


def test_the_level_is_the_inverse_of_the_quantile() -> None:
    u = np.random.default_rng(6).random((50, 1))
    np.testing.assert_allclose(level(quantile(u, OnePrior(FACTOR)), OnePrior(FACTOR)), u, atol=1e-12)


def test_a_parameter_that_the_prior_does_not_free_is_refused() -> None:
    prior, known = flow()
    with pytest.raises(ValueError, match="wall_thickness: the prior frees no such parameter, only k0_kpa"):
        extended_proposal(known, prior, "wall_thickness")


@dataclass(frozen=True)
class Held:
    """Settings that hold a prior."""

    prior: JointPriorSettings


@dataclass(frozen=True)
class Gaussian:
    """A likelihood that is normal in the log of all parameters, with the factor and k_SR correlated."""

    settings: HasPrior
    mean: FloatArray
    covariance: FloatArray

    def log_likelihood(self, phi: FloatArray) -> FloatArray:
        return np.asarray(multivariate_normal(self.mean, self.covariance).logpdf(np.log(phi)))


@dataclass(frozen=True)
class Lognormal:
    """What is known of the four reported parameters: independent normals in their logs, within the box."""

    prior: JointPriorSettings
    mean: FloatArray
    sd: float

    def draw(self, draws: int, seed: int) -> FloatArray:
        rng = np.random.default_rng(seed)
        return np.asarray(np.exp(self.mean + self.sd * rng.standard_normal((draws, len(self.mean)))))

    def log_density(self, phi: FloatArray) -> FloatArray:
        logs = np.log(phi)
        return np.asarray((norm.logpdf(logs, self.mean, self.sd) - logs).sum(axis=1))

    def place(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        return LogitSpace(self.prior).place(phi)

    def at(self, u: FloatArray) -> FloatArray:
        return LogitSpace(self.prior).at(u)


def gaussian_case() -> tuple[Gaussian, ExtendedProposal, FloatArray, FloatArray]:
    """Return a model of five parameters, its proposal, and mean and covariance of its posterior in log."""
    plain = speed_case.settings("paper").prior
    prior = with_stressed_volume(plain, FACTOR)
    centre = np.log([60.0, 7.0, 28.0, 2.2, 1.05])
    covariance = np.diag([0.05, 0.06, 0.05, 0.05, 0.06]) ** 2
    covariance[2, 4] = covariance[4, 2] = 0.7 * 0.05 * 0.06
    own = np.array([[parameter.log_sd, np.log(parameter.centre)] for parameter in prior.parameters])
    precision = np.linalg.inv(covariance) + np.diag(own[:, 0] ** -2)
    posterior = np.linalg.inv(precision)
    mean = posterior @ (np.linalg.inv(covariance) @ centre + own[:, 1] / own[:, 0] ** 2)
    model = Gaussian(Held(prior), centre, covariance)
    return model, extended_proposal(Lognormal(plain, centre[:4], 0.08), prior, VOLUME_FACTOR), mean, posterior


def test_weights_give_the_posterior_of_a_gaussian_case() -> None:
    """Mean, covariance and correlation that the proposal does not have; truncation lies far outside."""
    model, made, mean, covariance = gaussian_case()
    weighted = weigh(model, made, 60_000, 0.1, seed=7)
    logs, weight = np.log(weighted.phi), weighted.weight
    found = weight @ logs
    effective = weighted.efficiency * len(weight)
    sd = np.sqrt(np.diag(covariance))
    assert (np.abs(found - mean) < 4.0 * sd / np.sqrt(effective)).all()
    centred = logs - found
    spread = centred.T @ (centred * weight[:, None])
    np.testing.assert_allclose(spread / np.outer(sd, sd), covariance / np.outer(sd, sd), atol=0.06)


def test_rounds_learn_what_the_factor_has_to_do_with_the_rest() -> None:
    model, made, _, _ = gaussian_case()
    found = [one.weighted.efficiency for one in adaptive_rounds(model, SETTINGS, 8, made)]
    assert found[0] < 0.2
    assert found[-1] > 0.3
