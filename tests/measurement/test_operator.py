from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import speed_case
from forward_model_cases import SETTINGS as FORWARD_MODEL
from numpy.typing import NDArray
from recordings import CONTEXT, RECORDING, clean_speed, make_samples, nominal_phase
from scipy.interpolate import PchipInterpolator

from swesbi.artefacts import Provenance
from swesbi.measurement.baseline import calibrated_passive
from swesbi.measurement.operator import (
    PassiveBaseline,
    PassiveCalibrationError,
    active_stiffness_map,
    calibrate_passive,
    late_diastolic,
    passive_scale,
    passive_shape,
    total_at_phases,
    total_curves,
)
from swesbi.measurement.settings import MeasurementSettings, PassiveSettings
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.recording.phases import analysis_grid, sample_cycle, to_grid

CYCLE = np.arange(200) / 200
MEASUREMENT = MeasurementSettings(grid_points=100, active_stiffness_map="identity")
PASSIVE = PassiveSettings(exponent_b=3.0, late_diastolic_window=(0.80, 0.97))


def wave(phase: NDArray[np.float64]) -> NDArray[np.float64]:
    return 3.0 + np.sin(2 * np.pi * phase) + 0.3 * np.cos(6 * np.pi * phase)


def observe() -> Observation:
    return ingest(make_samples(), CONTEXT, RECORDING, 100)


def reference_beat(active: NDArray[np.float64] | None = None) -> SimpleNamespace:
    """A beat with a stretch that falls in systole and 0.2 kPa of active stiffness left in diastole."""
    active = 0.2 + 20.0 * np.exp(-0.5 * ((CYCLE - 0.4) / 0.1) ** 2) if active is None else active
    stretch = 1.05 - 0.25 * np.exp(-0.5 * ((CYCLE - 0.45) / 0.15) ** 2)
    return SimpleNamespace(
        cycle_phase=CYCLE,
        active_stiffness_kpa=active[None],
        stretch=stretch[None],
        status=np.array([0], dtype=np.int8),
    )


def test_cycle_is_sampled_as_a_smooth_periodic_function() -> None:
    phase = np.array([0.0, 0.0125, 0.4, 0.9987])
    np.testing.assert_allclose(sample_cycle(CYCLE, wave(CYCLE), phase), wave(phase), atol=1e-6)
    np.testing.assert_allclose(sample_cycle(CYCLE, wave(CYCLE), CYCLE[::7]), wave(CYCLE)[::7], atol=1e-12)


def test_cycle_sampling_keeps_leading_dimensions_and_rows_apart() -> None:
    curves = wave(CYCLE) * np.arange(1.0, 7.0).reshape(2, 3, 1)
    phase = nominal_phase()
    sampled = sample_cycle(CYCLE, curves, phase)
    assert sampled.shape == (2, 3, 20)
    np.testing.assert_array_equal(sampled[1, 2], sample_cycle(CYCLE, curves[1, 2], phase))


def test_a_grid_curve_is_the_closed_monotone_cubic_through_its_values() -> None:
    """It neither overshoots nor knows where the cycle starts."""
    phase, values = nominal_phase(), wave(nominal_phase()) + np.arange(20) % 3
    knots = np.concatenate([phase + turn for turn in (-2, -1, 0, 1, 2)])
    expected = PchipInterpolator(knots, np.tile(values, 5))(analysis_grid(100))
    curve = to_grid(phase, values, 100)
    np.testing.assert_allclose(curve, expected, atol=1e-12)
    assert curve[0] == curve[-1]


def test_grid_rows_do_not_depend_on_their_company() -> None:
    rng = np.random.default_rng(0)
    values = rng.uniform(1, 5, (5000, 20))
    together = to_grid(nominal_phase(), values, 100)
    np.testing.assert_array_equal(together[4000:4003], to_grid(nominal_phase(), values[4000:4003], 100))


@pytest.mark.parametrize("phase", [[0.1, 0.5], [0.1, 0.1, 0.5], [0.5, 0.1, 0.7], [0.1, 0.5, 1.0]])
def test_impossible_phases_are_refused(phase: list[float]) -> None:
    with pytest.raises(ValueError, match="phases"):
        to_grid(np.array(phase), np.ones(len(phase)), 100)


def test_simulated_and_observed_curves_take_the_same_path() -> None:
    observation = observe()
    observation = replace(observation, measured=np.arange(20) != 12)
    stiffness = 3.0 * clean_speed() ** 2
    observed = to_grid(observation.measured_phase, stiffness[observation.measured], 100)
    fine = sample_cycle(nominal_phase(), stiffness, CYCLE)
    passive = PassiveBaseline(1.0, CYCLE, np.ones(200), np.full(200, 2.0), 0.0, 0.0)
    simulated = total_curves((CYCLE, fine[None] - 2.0), passive, observation, MEASUREMENT)
    np.testing.assert_allclose(simulated[0], observed, rtol=2e-3)
    everywhere = total_at_phases((CYCLE, fine[None] - 2.0), passive, observation, MEASUREMENT)
    np.testing.assert_allclose(everywhere[0], stiffness, rtol=2e-3)


def test_another_cycle_than_the_baseline_has_is_refused() -> None:
    passive = PassiveBaseline(1.0, CYCLE, np.ones(200), np.ones(200), 0.0, 0.0)
    with pytest.raises(ValueError, match="400 points, the passive baseline 200"):
        total_curves((np.arange(400) / 400, np.ones((1, 400))), passive, observe(), MEASUREMENT)


def test_unknown_stiffness_map_is_refused() -> None:
    with pytest.raises(ValueError, match="no active stiffness map 'cubic'; known: identity"):
        active_stiffness_map("cubic")


def test_a_spring_in_series_gives_half_where_both_are_equal_and_little_change_where_it_is_stiffer() -> None:
    mapped = active_stiffness_map("series_spring")(np.array([0.0, 3.0, 300.0]))
    np.testing.assert_allclose(mapped, [0.0, 3.0 / 1.01, 150.0])


@pytest.mark.parametrize("exponent", [0.0, 2.0, 4.0])
def test_passive_calibration_hits_its_target(exponent: float) -> None:
    observation, beat = observe(), reference_beat()
    settings = PASSIVE.model_copy(update={"exponent_b": exponent})
    passive = calibrate_passive(observation, beat, settings, MEASUREMENT)
    total = total_at_phases((CYCLE, beat.active_stiffness_kpa), passive, observation, MEASUREMENT)[0]
    window = late_diastolic(observation, settings)
    assert window.sum() == 3
    np.testing.assert_allclose(total[window].mean(), observation.stiffness_kpa[window].mean(), rtol=1e-10)
    np.testing.assert_allclose(
        passive.stiffness_kpa, passive.scale_kpa * np.exp(exponent * (beat.stretch[0] ** 2 - 1))
    )


def test_missing_phases_do_not_enter_the_calibration() -> None:
    observation = observe()
    measured = observation.phase < 0.95
    measured[17] = False
    stiffness = np.where(measured, observation.stiffness_kpa, np.nan)
    passive = calibrate_passive(
        replace(observation, measured=measured, stiffness_kpa=stiffness),
        reference_beat(),
        PASSIVE,
        MEASUREMENT,
    )
    np.testing.assert_allclose(passive.late_diastolic_observed_kpa, stiffness[[16, 18]].mean())


def test_many_recordings_are_calibrated_at_once() -> None:
    observation, beat = observe(), reference_beat()
    window = late_diastolic(observation, PASSIVE)
    active, shape = sample_cycle(
        CYCLE,
        np.stack([beat.active_stiffness_kpa[0], passive_shape(beat.stretch[0], 3.0)]),
        observation.phase,
    )
    recordings = observation.stiffness_kpa * np.array([[1.0], [1.1]])
    scales = passive_scale(recordings, active, shape, window)
    single = calibrate_passive(observation, beat, PASSIVE, MEASUREMENT).scale_kpa
    np.testing.assert_allclose(scales[0], single, rtol=1e-12)
    assert scales[1] > scales[0]


@pytest.mark.parametrize(
    ("beat", "window", "message"),
    [
        (reference_beat(np.full(200, 50.0)), (0.8, 0.97), "does not exceed the active part.*50.00 kPa"),
        (reference_beat(), (0.98, 0.99), "no measured phase lies in the late-diastolic window"),
        (SimpleNamespace(status=np.array([1])), (0.8, 0.97), "did not become periodic"),
    ],
)
def test_impossible_calibrations_are_refused(
    beat: SimpleNamespace, window: tuple[float, float], message: str
) -> None:
    settings = PASSIVE.model_copy(update={"late_diastolic_window": window})
    with pytest.raises(PassiveCalibrationError, match=f"subject T.*{message}"):
        calibrate_passive(observe(), beat, settings, MEASUREMENT)


def test_passive_stage_meets_the_observed_late_diastole(tmp_path: Path) -> None:
    made = calibrated_passive(
        observe(),
        reference_prior=speed_case.shipped().priors["paper"],
        forward_model=FORWARD_MODEL,
        passive=PASSIVE,
        measurement=MEASUREMENT,
    )
    made.write(tmp_path / "passive.h5", Provenance("", "T", 1))
    passive = PassiveBaseline.read(tmp_path / "passive.h5")
    window = late_diastolic(observe(), PASSIVE)
    observed = observe().stiffness_kpa[window].mean()
    np.testing.assert_allclose(passive.late_diastolic_observed_kpa, observed)
    assert 0.0 < passive.late_diastolic_active_kpa < 1.0
    assert 0.5 < passive.stiffness_kpa.min() < passive.stiffness_kpa.max() < 10.0
    assert PassiveBaseline.load(tmp_path / "passive.h5")[0]["/"]["stiffness_kpa"].attrs["units"] == "kPa"
