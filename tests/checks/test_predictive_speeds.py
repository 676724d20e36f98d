"""Predictive checks with noise: spread, units, missing phases, coverage, and what is withheld."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import speed_case
from evaluation_study import make_model, noise_of
from exact_shown import verdict
from posterior_case import exact_of

from swesbi.checks.predictive import CheckedFeatures, Prediction, Replicates, predict
from swesbi.checks.predictive_speeds import (
    Recorder,
    check_of_speeds,
    feature_noise_sd,
    new_recordings,
    prior_recordings,
)
from swesbi.heart.prior_simulations import PriorSimulations, draw_simulations
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import measured_speeds
from swesbi.recording.speed import youngs_modulus_kpa

PHI = np.array([[58.0, 6.0, 28.0, 4.4]])
DRAWS = 4000
LATE_DIASTOLE = 17
FEATURES = ("maximum_kpa", "time_to_peak_cycle")


@cache
def recorder() -> Recorder:
    observation = make_model("A").observation
    model = SpeedModel(measured_speeds(observation), speed_case.settings())
    summary = speed_case.shipped().speed_experiments["calibrated"].summary
    return Recorder(model, observation, CheckedFeatures(FEATURES, summary))


@cache
def known() -> Replicates:
    """New recordings of one phi, again and again."""
    return new_recordings(np.repeat(PHI, DRAWS, axis=0), recorder(), np.random.default_rng(4))


def predicted(made: Replicates) -> Prediction:
    return predict(made, recorder().target(feature_noise_sd(made)), 0.9, of_new=True)


@cache
def prior_simulations() -> PriorSimulations:
    config = speed_case.shipped()
    context = recorder().observation.context
    return draw_simulations(range(300), context, config.priors["calibrated"], config.forward_model, 5)


def test_intervals_have_the_spread_of_noise_and_discrepancy_in_speed_and_timing() -> None:
    made, model = known(), recorder().model
    predicted = model.predict(PHI)
    discrepancy = model.settings.discrepancy
    timing = discrepancy.timing_cycle * predicted.slope[0]
    relative = np.sqrt(model.recording.relative_se**2 + discrepancy.speed_fraction**2 + timing**2)
    measured = recorder().observation.measured
    for values, sd in ((made.phase_kpa, relative), (made.measured_kpa, model.recording.relative_se)):
        # E goes with the square of the speed
        np.testing.assert_allclose(np.log(values[:, measured]).std(axis=0), 2.0 * sd, rtol=0.06)
    clean = youngs_modulus_kpa(predicted.speed_m_s[0], 1000.0)
    np.testing.assert_allclose(made.draws.phase_kpa[0, measured], clean)
    for curves in (made.draws.phase_kpa, made.phase_kpa):
        np.testing.assert_array_equal(np.isnan(curves).any(axis=0), ~measured)


def test_bands_cover_new_recordings_as_often_as_they_say() -> None:
    measured, found = recorder().observation.measured, predicted(known())
    fresh = new_recordings(np.repeat(PHI, 500, axis=0), recorder(), np.random.default_rng(9))
    inside = (fresh.phase_kpa >= found.phases.low) & (fresh.phase_kpa <= found.phases.high)
    assert inside[:, measured].mean() == pytest.approx(0.9, abs=0.01)
    on_grid = (fresh.curve_kpa >= found.curve.low) & (fresh.curve_kpa <= found.curve.high)
    assert on_grid.mean() == pytest.approx(0.9, abs=0.02)


def test_the_median_is_that_of_the_noiseless_curve() -> None:
    made = known()
    found = predicted(made)
    np.testing.assert_allclose(found.curve.median, made.draws.curve_kpa[0])
    error = recorder().observation.curve_kpa - made.draws.curve_kpa[0]
    assert found.scores.rmse_kpa == pytest.approx(np.sqrt(np.mean(error**2)))
    assert found.coverage_recording_noise <= found.phase_scores.coverage


def test_the_prior_prediction_varies_the_passive_stiffness() -> None:
    made = prior_recordings(prior_simulations(), 300, recorder(), np.random.default_rng(2))
    spread = np.log(made.draws.phase_kpa[:, LATE_DIASTOLE]).std()
    prior = recorder().model.settings.prior.passive_stiffness_kpa
    assert spread == pytest.approx(prior.log_sd, rel=0.3)


def test_standard_errors_shown_are_those_of_the_observation_model() -> None:
    target = recorder().target(np.zeros(2))
    expected = 2.0 * recorder().model.recording.relative_se * target.stiffness_kpa[target.measured]
    np.testing.assert_allclose(target.stiffness_se_kpa[target.measured], expected)
    ones = np.ones((target.measured.sum(), 1))
    recording = replace(recorder().model.recording, shared=0.03 * ones)
    of_sweeps = replace(recorder(), model=replace(recorder().model, recording=recording))
    total = np.hypot(recording.relative_se, 0.03) / recording.relative_se
    wider = of_sweeps.target(np.zeros(2)).stiffness_se_kpa[target.measured]
    np.testing.assert_allclose(wider, total * expected)


@pytest.mark.parametrize(("subject", "scored"), [("A", True), ("D", True), ("F", False)])
def test_the_stage_scores_who_is_not_contradicted(subject: str, scored: bool) -> None:
    rng = np.random.default_rng(1)
    phi = PHI * np.exp(0.03 * rng.standard_normal((300, 4)))
    experiment = speed_case.shipped().speed_experiments["calibrated"]
    check = check_of_speeds(
        exact_of(phi, k_hat=0.2, efficiency=0.8),
        verdict(subject),
        recorder().observation,
        noise_of(["A"]),
        prior_simulations(),
        model=speed_case.settings(),
        summary=experiment.summary,
        predictive=experiment.predictive.model_copy(update={"draws": 200}),
        seed=7,
    )
    assert check.may_be_read == scored
    assert np.isfinite(check.posterior.scores.rmse_kpa) == scored
    assert np.isfinite(check.posterior.curve.median).all() and len(check.posterior.draws.theta) == 200
    assert check.prior.scores.rmse_kpa > 0.0
    if scored:
        assert check.posterior.phase_scores.coverage > 0.7
