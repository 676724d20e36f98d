"""The first proposal without a network: exact where the model is linear, a wide start where it is not."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import speed_case
from exact_case import SETTINGS, ToySettings

from swesbi.base.arrays import FloatArray
from swesbi.posterior.adaptive import adaptive_rounds
from swesbi.posterior.fitted import StudentMixture
from swesbi.posterior.hearts import HeartModel
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
    proposal = laplace_proposal(model, 1).student
    assert isinstance(proposal, StudentMixture)
    student = proposal.parts[0]
    precision = np.eye(model.slope.shape[1]) + model.slope.T @ model.slope
    covariance = np.linalg.inv(precision)
    np.testing.assert_allclose(student.scale / WIDER, covariance, atol=2e-3)
    for part in proposal.parts:  # every search ends there
        np.testing.assert_allclose(part.mean, -covariance @ model.slope.T @ model.offset, atol=1e-2)
    np.testing.assert_allclose(proposal.share, 1.0 / len(proposal.parts), atol=1e-3)


@dataclass(frozen=True)
class TwoModes(Linear):
    """The same, but the first score is measured without its sign."""

    def standardised(self, phi: FloatArray) -> FloatArray:
        u, _ = ScoreSpace(self.settings.prior).place(phi)
        return np.column_stack([5.0 * (np.abs(u[:, 0]) - 1.0), super().standardised(phi)])


def test_each_of_two_modes_has_a_part() -> None:
    plain = linear(speed_case.settings("calibrated").prior)
    blind = plain.slope * (np.arange(plain.slope.shape[1]) > 0)
    proposal = laplace_proposal(TwoModes(plain.settings, blind, plain.offset), 1).student
    assert isinstance(proposal, StudentMixture)
    first = np.array([part.mean[0] for part in proposal.parts])
    share = proposal.share[first > 0.5].sum()
    assert 0.1 < share < 0.9
    assert proposal.share[np.abs(np.abs(first) - 1.0) < 0.1].sum() > 0.8


def test_hearts_of_gated_recordings_and_of_pushes_have_residuals() -> None:
    gated = speed_case.model(prior="calibrated")
    pushes = replace(gated, recording=replace(gated.recording, cell=np.arange(20)))
    for model in (gated, pushes):
        assert isinstance(HeartModel(model), ResidualModel)


def test_it_begins_nearer_to_the_posterior_than_the_prior_and_than_a_wrong_mode() -> None:
    """Of the draws of the first round many times as many are effective."""
    model = HeartModel(speed_case.model(prior="calibrated"))
    found = laplace_proposal(model, 1)
    assert isinstance(found.student, StudentMixture)
    parts = tuple(replace(part, mean=part.mean + 1.0) for part in found.student.parts)
    moved = replace(found, student=replace(found.student, parts=parts))
    settings = SETTINGS.model_copy(update={"max_rounds": 0})
    begun, wrong, prior = (
        next(adaptive_rounds(model, settings, 2, first)).weighted.efficiency for first in (found, moved, None)
    )
    assert begun > 5.0 * max(wrong, prior)
    assert begun > 0.01
