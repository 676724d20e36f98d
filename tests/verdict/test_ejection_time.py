from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
import pytest
import speed_case
from pydantic import ValidationError
from rules import settings_of

from data.makers.clinical import true_measures
from swesbi.config.read import read_merged
from swesbi.config.study import load_study
from swesbi.context import Context
from swesbi.heart.beats import systolic_intervals
from swesbi.heart.periodic import Status
from swesbi.heart.simulate import Beats, simulate
from swesbi.measurement.likelihood import SpeedModel
from swesbi.population.contexts import draw_population
from swesbi.prior import quantile
from swesbi.recording.cohort.clinical import NOT_MEASURED, ClinicalMeasures
from swesbi.recording.cohort.subjects import read_subject_table
from swesbi.verdict.beat import ejection_tests
from swesbi.verdict.nulls import Grade
from swesbi.verdict.recording import VerdictSettings, grade
from swesbi.verdict.settings import EjectionTimeSettings
from swesbi.verdict.verdict import VerdictTest
from swesbi.virtual.volunteers import VOLUNTEERS, Volunteer, forward_model_of, simulate_truth

CONFIG: Final = speed_case.shipped()
SETTINGS: Final = CONFIG.speed_experiments["calibrated"].misspecification.ejection_time
LVET_SD_MS: Final = CONFIG.clinical.lvet_sd_ms
SPREAD: Final = np.array([0.10, 0.20, 0.15, 0.05])
"""Log standard deviations of a posterior of phi, about the truth."""
CENTRE: Final = (60.0, 6.0, 29.0)
by_name = pytest.mark.parametrize("volunteer", VOLUNTEERS, ids=lambda one: one.context.subject)


def model_of(context: Context) -> SpeedModel:
    made = speed_case.model()
    return replace(made, recording=replace(made.recording, context=context))


def beats_about(context: Context, theta: tuple[float, ...], seed: int = 3, draws: int = 100) -> Beats:
    rng = np.random.default_rng(seed)
    phi = np.array([*theta, 2.2]) * np.exp(SPREAD * rng.standard_normal((draws, 4)))
    return model_of(context).simulate(np.clip(phi, 0.2, 250.0))


def beats_of(volunteer: Volunteer, draws: int = 100) -> Beats:
    """Beats about a volunteer's own, its physiology included, in the steps of the inference model."""
    steps = {"steps_per_beat": 400, "samples_per_beat": 200, "maximum_step_s": 2.7e-3}
    settings = forward_model_of(volunteer).model_copy(update=steps)
    spread = SPREAD[:3] * np.random.default_rng(3).standard_normal((draws, 3))
    return simulate(np.array(volunteer.theta) * np.exp(spread), volunteer.context, settings)


def judged(beats: Beats, context: Context, lvet_ms: float) -> VerdictTest:
    (test,) = ejection_tests(beats, context.period_s, ClinicalMeasures(lvet_ms=lvet_ms), LVET_SD_MS, SETTINGS)
    return test


@by_name
def test_the_shipped_ejection_times_pass_and_80_ms_off_do_not(volunteer: Volunteer) -> None:
    context = volunteer.context
    rows = read_subject_table(speed_case.ROOT / "data" / "virtual_volunteers" / "subjects.csv").clinical
    measured = rows[context.subject].to_measures().lvet_ms
    beats = beats_of(volunteer)
    assert not judged(beats, context, measured).flagged
    true = true_measures(simulate_truth(volunteer)).lvet_ms
    for wrong in (true - 80.0, true + 80.0):
        test = judged(beats, context, wrong)
        assert test.flagged and np.sign(test.statistic) == np.sign(true - wrong)
        assert grade(Grade.NOT_CONTRADICTED, (), (test,), 6.0) == Grade.DOUBTFUL


def test_the_distance_is_over_posterior_measurement_and_model() -> None:
    context = speed_case.CONTEXT
    beats = beats_about(context, CENTRE)
    lvet = 1e3 * systolic_intervals(beats, context.period_s).ejection_s
    sd = np.sqrt(lvet.var() + LVET_SD_MS**2 + SETTINGS.model_sd_ms**2)
    test = judged(beats, context, float(np.median(lvet) - 30.0))
    assert test.statistic == pytest.approx(30.0 / sd)
    assert test.name == "ejection_time" and test.p_value is None
    assert test.threshold == pytest.approx(2.576, abs=1e-3)
    assert "ms measured" in test.detail and test.detail.startswith("LVET ")


def test_there_is_no_test_where_nothing_was_measured() -> None:
    beats = beats_about(speed_case.CONTEXT, CENTRE, draws=5)
    for clinical in (NOT_MEASURED, ClinicalMeasures(sbp_mmhg=118.0, dbp_mmhg=74.0)):
        assert ejection_tests(beats, speed_case.CONTEXT.period_s, clinical, LVET_SD_MS, SETTINGS) == ()


def test_failed_simulations_are_left_out_and_a_valve_that_never_opens_ejects_for_no_time() -> None:
    context = speed_case.CONTEXT
    beats = beats_about(context, CENTRE, draws=40)
    whole = judged(beats, context, 250.0)
    status, flow = beats.status.copy(), beats.aortic_flow_ml_s.copy()
    status[:5], flow[:5] = Status.OUT_OF_RANGE, np.nan
    failed = replace(beats, status=status, aortic_flow_ml_s=flow)
    assert judged(failed, context, 250.0).statistic == pytest.approx(whole.statistic, abs=0.5)
    never = replace(beats, aortic_flow_ml_s=np.zeros_like(flow))
    assert judged(never, context, 250.0).detail.startswith("LVET 0 ms predicted [0, 0], 250 ms measured")


@pytest.mark.parametrize("group", ["adults", "children", "dilated"])
def test_hearts_that_the_model_describes_raise_an_alarm_no_oftener_than_is_said(group: str) -> None:
    rng, hearts = np.random.default_rng(13), 60
    population = CONFIG.population_experiments["amortised"].population
    drawn = [one.context for one in draw_population(range(6 * hearts), population, 1, "ejection")
             if one.group == group][:hearts]  # fmt: skip
    flags = []
    for context in drawn:
        truth = quantile(rng.random((1, 3)), CONFIG.priors["calibrated"])[0]
        own = model_of(context).simulate(np.array([[*truth, 2.2]]))
        true_ms = 1e3 * float(systolic_intervals(own, context.period_s).ejection_s[0])
        seen = tuple(truth * np.exp(SPREAD[:3] * rng.standard_normal(3)))
        beats = beats_about(context, seen, int(rng.integers(1000)), 24)
        flags.append(judged(beats, context, true_ms + LVET_SD_MS * rng.standard_normal()).flagged)
    assert len(flags) == hearts
    # Three standard errors of a share of 1 %.
    assert np.mean(flags) <= SETTINGS.doubtful_level + 3.0 * np.sqrt(0.01 / hearts)


def test_the_stage_knows_how_well_it_is_measured() -> None:
    raw = read_merged(speed_case.ROOT / "config.yaml")
    raw["cohort"] = str(speed_case.ROOT / "data" / "virtual_volunteers")
    plain = settings_of("verdict", load_study(raw), experiment="calibrated", subject="A")
    settings = VerdictSettings.from_plain(plain)
    assert settings.lvet_sd_ms == LVET_SD_MS
    assert settings.ejection_time == SETTINGS


@pytest.mark.parametrize("change", [{"model_sd_ms": 0.0}, {"doubtful_level": 0.5}, {"limit": 3.0}])
def test_tolerance_and_level_must_make_sense(change: dict[str, float]) -> None:
    with pytest.raises(ValidationError):
        EjectionTimeSettings.from_plain(SETTINGS.to_plain() | change)
