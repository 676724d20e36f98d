"""A proposal for one parameter more than is known, and the posterior that rounds make of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import speed_case
from exact_case import SETTINGS
from scipy.stats import multivariate_normal, norm

from swesbi.base.arrays import FloatArray
from swesbi.draws import equal_weights
from swesbi.heart.physiology import VOLUME_FACTOR
from swesbi.measurement.clinical import with_stressed_volume
from swesbi.posterior.adaptive import adaptive_rounds
from swesbi.posterior.fitted import fitted_with_further
from swesbi.posterior.importance import HasPrior, WeightedDraws
from swesbi.prior import JointPriorSettings, SomeParameters, in_bounds, level, log_centre

FACTOR = speed_case.shipped().clinical.stressed_volume_factor
CENTRE = np.log([60.0, 7.0, 28.0, 2.2, 1.05])


@dataclass(frozen=True)
class Held:
    """Settings that hold a prior."""

    prior: JointPriorSettings


@dataclass(frozen=True)
class Gaussian:
    """A likelihood that is normal in the log of all parameters, with the factor and k_SR correlated."""

    settings: HasPrior
    covariance: FloatArray

    def log_likelihood(self, phi: FloatArray) -> FloatArray:
        return np.asarray(multivariate_normal(CENTRE, self.covariance).logpdf(np.log(phi)))


def weighted(phi: FloatArray) -> WeightedDraws:
    """Return draws of equal weight."""
    nothing, log_weight = np.zeros(len(phi)), np.log(equal_weights(len(phi)))
    return WeightedDraws(phi, nothing > 0.0, nothing, log_weight, 0.0, 1.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def prior() -> JointPriorSettings:
    return with_stressed_volume(speed_case.settings("paper").prior, FACTOR)


@pytest.fixture(scope="module")
def known() -> WeightedDraws:
    """What is known of the four reported parameters: independent normals in their logs."""
    return weighted(np.exp(CENTRE[:4] + 0.08 * np.random.default_rng(1).standard_normal((4000, 4))))


def test_the_further_parameter_has_its_prior_and_the_others_what_is_known() -> None:
    """Of sixteen parameters, with the further one in the twelfth place from zero, as an answer has it."""
    plain = speed_case.settings("calibrated").prior
    prior = with_stressed_volume(plain, FACTOR)
    column, centre = prior.names.index(VOLUME_FACTOR), np.log(log_centre(plain))
    assert column == 12 < len(prior.names) - 1
    known = weighted(np.exp(centre + 0.02 * np.random.default_rng(5).standard_normal((4000, len(centre)))))
    drawn = fitted_with_further(known, prior, VOLUME_FACTOR, 1).draw(20_000, 2)
    assert in_bounds(drawn, prior).all()
    others = np.log(np.delete(drawn, column, axis=1))
    assert np.abs(others.mean(axis=0) - centre).max() < 0.01
    score = norm.ppf(level(drawn[:, [column]], SomeParameters((FACTOR,))))[:, 0]
    assert abs(score.mean()) < 0.1
    assert 1.0 < score.std() < 1.5  # wider, since a proposal is
    assert np.abs(np.corrcoef(np.column_stack([others, score]).T)[-1, :-1]).max() < 0.1


def test_rounds_give_the_posterior_of_a_gaussian_case(
    prior: JointPriorSettings, known: WeightedDraws
) -> None:
    """Mean, covariance and the correlation that the proposal does not have; truncation lies far outside."""
    covariance = np.diag([0.05, 0.06, 0.05, 0.05, 0.06]) ** 2
    covariance[2, 4] = covariance[4, 2] = 0.7 * 0.05 * 0.06
    own = np.array([[parameter.log_sd, np.log(parameter.centre)] for parameter in prior.parameters])
    expected = np.linalg.inv(np.linalg.inv(covariance) + np.diag(own[:, 0] ** -2))
    mean = expected @ (np.linalg.inv(covariance) @ CENTRE + own[:, 1] / own[:, 0] ** 2)
    began = fitted_with_further(known, prior, VOLUME_FACTOR, 3)
    rounds = list(adaptive_rounds(Gaussian(Held(prior), covariance), SETTINGS, 8, began))
    last = rounds[-1].weighted
    logs, weight, sd = np.log(last.phi), last.weight, np.sqrt(np.diag(expected))
    found, effective = weight @ logs, last.efficiency * len(weight)
    assert (np.abs(found - mean) < 4.0 * sd / np.sqrt(effective)).all()
    spread = (logs - found).T @ ((logs - found) * weight[:, None])
    np.testing.assert_allclose(spread / np.outer(sd, sd), expected / np.outer(sd, sd), atol=0.15)
    assert last.efficiency > rounds[0].weighted.efficiency
