"""The likelihood of natural waves against dense normal densities; that of pushes is as it was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import speed_case
from numpy.typing import NDArray
from scipy.stats import multivariate_normal

from swesbi.heart.closures import valve_closures
from swesbi.measurement.instants import FreeModel, cell_innovations
from swesbi.measurement.natural_waves import NaturalWaves, predict_at_closures
from swesbi.measurement.speeds import SpeedRecording
from swesbi.prior import draw_prior
from swesbi.recording.phases import sample_cycle, sample_each, slope_cycle

FloatArray = NDArray[np.float64]
OMEGA = {"mvc": 0.15, "avc": 0.25}
EVENTS = np.array(["push", "push", "mvc", "mvc", "avc", "avc", "avc"])
CELL = np.array([3, 9, 20, 20, 21, 21, 21])


def wave_model(prior: str = "paper") -> FreeModel:
    """Two pushes, two mitral and three aortic waves."""
    gated = speed_case.model(prior=prior)
    phase = np.array([0.17, 0.47, *[np.nan] * 5])
    speed = np.array([1.9, 2.6, 1.4, 1.5, 3.1, 3.3, 2.9])
    se = np.linspace(0.05, 0.11, 7)
    recording = SpeedRecording(gated.recording.context, phase, speed, se, np.empty((7, 0)))
    return FreeModel(replace(gated, recording=recording), CELL, 0.0, NaturalWaves(EVENTS, OMEGA))


def test_a_cycle_is_evaluated_at_a_phase_of_its_own() -> None:
    cycle = np.arange(200) / 200
    curves = np.sin(2.0 * np.pi * (cycle[None] + np.array([[0.1], [0.2], [0.3]])))
    phase = np.array([0.0123, 0.9987, np.nan])
    every, slopes = sample_cycle(cycle, curves, phase[:2]), slope_cycle(cycle, curves, phase[:2])
    np.testing.assert_allclose(sample_each(cycle, curves, phase)[:2], [every[0, 0], every[1, 1]], rtol=1e-12)
    moving = sample_each(cycle, curves, phase, 1)[:2]
    np.testing.assert_allclose(moving, [slopes[0, 0], slopes[1, 1]], rtol=1e-12)
    assert np.isnan(sample_each(cycle, curves, phase)[2])


@pytest.mark.parametrize("passive_beat", ["own", "reference"])
def test_a_wave_has_the_speed_of_the_wall_at_its_own_closure(passive_beat: str) -> None:
    """Each simulation is asked at its own closure as a recording with a push there would be."""
    settings = speed_case.settings().model_copy(update={"passive_beat": passive_beat})
    plain = speed_case.model()
    model = replace(plain, settings=settings, reference=settings.reference_of(plain.recording.context))
    phi = draw_prior(settings.prior, 12, np.random.default_rng(1))
    beats = model.simulate(phi)
    predicted = predict_at_closures(model, phi, beats)
    closures = valve_closures(beats, settings.forward_model)
    for column, phases in enumerate((closures.mitral, closures.aortic)):
        for row in np.flatnonzero(np.isfinite(phases)):
            there = replace(model, recording=replace(model.recording, phase=phases[row : row + 1]))
            alone = there.predict(phi[row : row + 1])
            assert predicted.log_speed[row, column] == pytest.approx(alone.log_speed[0, 0], rel=1e-9)
            assert predicted.slope[row, column] == pytest.approx(alone.slope[0, 0], rel=1e-6, abs=1e-9)


def test_waves_of_an_event_share_what_the_model_misses_of_them() -> None:
    model = wave_model()
    phi = draw_prior(model.settings.prior, 30, np.random.default_rng(2))
    predicted = model.predict(phi)
    recording, discrepancy = model.model.recording, model.settings.discrepancy
    same = CELL[:, None] == CELL[None]
    level = np.array([discrepancy.speed_fraction**2 + OMEGA.get(str(event), 0.0) ** 2 for event in EVENTS])
    told = model.log_likelihood(phi)
    for row in np.flatnonzero(np.isfinite(told)):
        moved = discrepancy.timing_cycle**2 * np.outer(predicted.slope[row], predicted.slope[row])
        covariance = np.diag(recording.relative_se**2) + same * (np.sqrt(np.outer(level, level)) + moved)
        dense = multivariate_normal(predicted.log_speed[row], covariance).logpdf(np.log(recording.speed_m_s))
        assert told[row] == pytest.approx(dense, abs=1e-8)
    assert np.isfinite(told).sum() > 25


def test_many_beats_never_tell_more_than_the_guided_wave_allows() -> None:
    """The shared term stays however many beats there are: a hundred say hardly more than twenty."""
    spread = []
    for beats in (1, 20, 100):
        ones = np.ones((1, beats))
        level = np.full(beats, 0.2)
        cell = np.zeros(beats, dtype=np.int64)
        at = [
            cell_innovations(shift * ones, 0.0 * ones, 0.1 * ones, cell, level, 0.0).log_density[0]
            for shift in (0.0, 0.1)
        ]
        spread.append(np.sqrt(0.1**2 / (2.0 * (at[0] - at[1]))))
    np.testing.assert_allclose(spread, np.sqrt(0.2**2 + 0.1**2 / np.array([1, 20, 100])), rtol=1e-9)


def test_a_simulation_whose_valve_never_closes_has_no_likelihood() -> None:
    model = wave_model()
    phi = draw_prior(model.settings.prior, 3, np.random.default_rng(5))
    beats = model.model.simulate(phi)
    shut = replace(beats, aortic_flow_ml_s=beats.aortic_flow_ml_s * np.array([[1.0], [0.0], [1.0]]))
    assert np.isnan(model.predict_from(phi, shut).log_speed[1]).any()
    total = model.log_joint(model.predict_from(phi, shut))
    assert np.isnan(total[0, 1])
    assert np.isfinite(total[0, [0, 2]]).all()


def test_pushes_alone_have_the_likelihood_that_they_had() -> None:
    """To the bit: the prediction of the plain model through the filter, with one discrepancy for all."""
    gated = speed_case.model()
    rng = np.random.default_rng(3)
    phase = np.sort(rng.random(30))
    recording = SpeedRecording(
        gated.recording.context, phase, 1.0 + 2.0 * rng.random(30), np.full(30, 0.1), np.empty((30, 0))
    )
    plain = replace(gated, recording=recording)
    phi = draw_prior(plain.settings.prior, 40, rng)
    predicted = plain.predict(phi)
    cell = (20 * phase).astype(np.int64)
    free = FreeModel(plain, cell, 0.0)
    distance = np.log(recording.speed_m_s) - predicted.log_speed
    se = np.broadcast_to(recording.relative_se, distance.shape)
    told = _filtered(distance, predicted.slope, se, cell, plain.settings.discrepancy.speed_fraction)
    np.testing.assert_array_equal(free.log_likelihood(phi)[np.isfinite(told)], told[np.isfinite(told)])
    beats = plain.simulate(phi)
    np.testing.assert_array_equal(free.predict_from(phi, beats).log_speed, free.predict(phi).log_speed)


def _filtered(
    distance: FloatArray, slope: FloatArray, se: FloatArray, cell: NDArray[np.int64], delta: float
) -> FloatArray:
    """The filter for pushes, written out with a scalar discrepancy."""
    timing_cycle = speed_case.settings().discrepancy.timing_cycle
    parts = []
    for i in range(len(cell)):
        if i == 0 or cell[i] != cell[i - 1]:
            mean_n, mean_m, cross = (np.zeros(len(distance)) for _ in range(3))
            var_n, var_m = np.ones(len(distance)), np.ones(len(distance))
        timing = timing_cycle * slope[:, i]
        gain_n, gain_m = var_n * delta + cross * timing, cross * delta + var_m * timing
        sd = np.sqrt(se[:, i] ** 2 + delta * gain_n + timing * gain_m)
        z = (distance[:, i] - delta * mean_n - timing * mean_m) / sd
        gain_n, gain_m = gain_n / sd, gain_m / sd
        mean_n, mean_m = mean_n + gain_n * z, mean_m + gain_m * z
        var_n, var_m, cross = var_n - gain_n**2, var_m - gain_m**2, cross - gain_n * gain_m
        parts.append(-0.5 * z**2 - np.log(sd) - 0.5 * np.log(2.0 * np.pi))
    return np.asarray(np.stack(parts, axis=1).sum(axis=1))
