"""The first proposal without a network: exact where the model is linear, a wide start where it is not."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import speed_case
from exact_case import SETTINGS, ToySettings

from swesbi.base.arrays import FloatArray
from swesbi.measurement.instants import FreeModel
from swesbi.posterior.adaptive import adaptive_rounds
from swesbi.posterior.laplace import WIDER, ResidualModel, laplace_proposal
from swesbi.posterior.space import ScoreSpace
from swesbi.prior import JointPriorSettings


@dataclass(frozen=True)
class Linear:
    """Residuals that are linear in normal scores: the posterior of these is normal, in closed form."""

    settings: ToySettings
    slope: FloatArray
    offset: FloatArray

    def standardised(self, phi: FloatArray) -> FloatArray:
        return self.offset + ScoreSpace(self.settings.prior).place(phi)[0] @ self.slope.T


def linear(prior: JointPriorSettings) -> Linear:
    rng = np.random.default_rng(3)
    d = len(prior.parameters)
    return Linear(ToySettings(prior), rng.standard_normal((6, d)), rng.standard_normal(6))


def test_mode_and_covariance_are_those_of_a_linear_model() -> None:
    model = linear(speed_case.settings("calibrated").prior)
    student = laplace_proposal(model, 1).student
    precision = np.eye(model.slope.shape[1]) + model.slope.T @ model.slope
    covariance = np.linalg.inv(precision)
    np.testing.assert_allclose(student.scale / WIDER, covariance, atol=2e-3)
    np.testing.assert_allclose(student.mean, -covariance @ model.slope.T @ model.offset, atol=1e-2)


def test_gated_recordings_and_pushes_have_residuals() -> None:
    gated = speed_case.model(prior="calibrated")
    for model in (gated, FreeModel(gated, np.arange(20), 0.0)):
        assert isinstance(model, ResidualModel)


def test_it_begins_nearer_to_the_posterior_than_the_prior_and_than_a_wrong_mode() -> None:
    """Of the draws of the first round many times as many are effective."""
    model = speed_case.model(prior="calibrated")
    found = laplace_proposal(model, 1)
    moved = replace(found, student=replace(found.student, mean=found.student.mean + 1.0))
    settings = SETTINGS.model_copy(update={"max_rounds": 0})
    begun, wrong, prior = (
        next(adaptive_rounds(model, settings, 2, first)).weighted.efficiency for first in (found, moved, None)
    )
    assert begun > 5.0 * max(wrong, prior)
    assert begun > 0.01


def test_it_depends_on_its_seed_alone() -> None:
    model = speed_case.model(prior="calibrated")
    one, again = (laplace_proposal(model, 1).student for _ in range(2))
    np.testing.assert_array_equal(one.mean, again.mean)
    np.testing.assert_array_equal(one.scale, again.scale)
