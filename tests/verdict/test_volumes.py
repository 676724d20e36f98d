from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
import pytest
import speed_case
from numpy.typing import NDArray
from pydantic import ValidationError

from swesbi.context import Context
from swesbi.measurement.likelihood import SpeedModel
from swesbi.population.contexts import draw_population
from swesbi.prior import quantile
from swesbi.verdict.beat import BeatQuantity, volume_tests
from swesbi.verdict.settings import VolumeSettings
from swesbi.verdict.verdict import VerdictTest
from swesbi.virtual.volunteers import VOLUNTEERS, Volunteer, simulate_truth

FloatArray = NDArray[np.float64]
SETTINGS: Final = speed_case.shipped().speed_experiments["calibrated"].misspecification.rule.volumes
SPREAD: Final = np.array([0.10, 0.20, 0.15, 0.05])
"""Log standard deviations of a posterior of phi, about those of the volunteers."""
ECHO_SD: Final = 0.25 / 1.96
"""Of one end-systolic volume, from 95 % limits of 25 % (Gordon et al. 1983)."""


def model_of(context: Context) -> SpeedModel:
    made = speed_case.model()
    return replace(made, recording=replace(made.recording, context=context))


def judged(context: Context, phi: FloatArray) -> tuple[VerdictTest, ...]:
    model = model_of(context)
    return volume_tests(model, phi, model.simulate(phi), SETTINGS)


def posterior_about(theta: tuple[float, ...], seed: int = 3, draws: int = 200) -> FloatArray:
    rng = np.random.default_rng(seed)
    return np.asarray(np.array([*theta, 2.2]) * np.exp(SPREAD * rng.standard_normal((draws, 4))))


def true_lvesv(volunteer: Volunteer) -> float:
    return float(simulate_truth(volunteer).beats.end_systolic_volume_ml[0])


def named(volunteer: Volunteer) -> str:
    return volunteer.context.subject


@pytest.mark.parametrize("volunteer", VOLUNTEERS, ids=named)
def test_the_volumes_of_the_shipped_cohort_pass(volunteer: Volunteer) -> None:
    diastolic, systolic = judged(volunteer.context, posterior_about(volunteer.theta))
    assert not diastolic.flagged and not systolic.flagged
    # Listed LVESV lies above that of the beat, most in G and H; the test sees the side and about how much.
    log_off = np.log(true_lvesv(volunteer) / volunteer.context.lvesv_ml)
    assert log_off < 0.0 and systolic.statistic < 0.0
    assert (systolic.statistic < -1.0) == (log_off < -0.15)
    assert (systolic.statistic < -1.5) == (log_off < -0.22) == (volunteer.context.subject in "GH")
    assert f"{volunteer.context.lvesv_ml:.0f} mL measured" in systolic.detail


@pytest.mark.parametrize("volunteer", VOLUNTEERS, ids=named)
def test_an_lvesv_far_from_that_of_the_beat_is_found(volunteer: Volunteer) -> None:
    phi, true = posterior_about(volunteer.theta), true_lvesv(volunteer)
    as_it_is = judged(replace(volunteer.context, lvesv_ml=true), phi)[1]
    assert abs(as_it_is.statistic) < 1.0
    wrong = judged(replace(volunteer.context, lvesv_ml=2.5 * true), phi)[1]
    assert wrong.flagged and wrong.statistic < -SETTINGS.doubtful_abs_z
    assert judged(replace(volunteer.context, lvesv_ml=0.2 * true), phi)[1].flagged


def test_a_septum_that_leaves_little_of_the_cavity_is_found() -> None:
    context = replace(speed_case.CONTEXT, lvedv_ml=60.0, lvesv_ml=20.0, ivsd_cm=1.8)
    diastolic = judged(context, posterior_about((60.0, 6.0, 29.0)))[0]
    assert diastolic.flagged and diastolic.statistic < 0.0
    assert diastolic.detail.startswith("LVEDV ")


def test_the_walls_share_of_the_tolerance_is_how_far_the_wall_moves_the_volume() -> None:
    phi = posterior_about((60.0, 6.0, 29.0))
    volumes = []
    for factor in (1.0, 1.0 + SETTINGS.wall_fraction):
        model = model_of(replace(speed_case.CONTEXT, ivsd_cm=factor * speed_case.CONTEXT.ivsd_cm))
        volumes.append(model.simulate(phi).end_systolic_volume_ml)
    measured, predicted = np.log(speed_case.CONTEXT.lvesv_ml), np.log(volumes[0])
    moved = float(np.median(np.abs(np.log(volumes[1]) - predicted)))
    expected = BeatQuantity(predicted, moved, measured, SETTINGS.lvesv_tolerance_fraction)
    assert judged(speed_case.CONTEXT, phi)[1].statistic == pytest.approx(expected.z, rel=1e-9)
    assert moved > 1.0 / speed_case.CONTEXT.lvesv_ml


@pytest.mark.parametrize("ivsd_cm", [0.2, 3.0])
def test_hearts_at_the_limits_of_the_model_have_another_wall_within_them(ivsd_cm: float) -> None:
    context = Context("X", "F", 40.0, 1.8, 70.0, 300.0 if ivsd_cm > 1.0 else 60.0, 50.0, ivsd_cm)
    assert len(judged(context, posterior_about((60.0, 6.0, 29.0), draws=20))) == 2


def false_alarms(group: str, hearts: int) -> FloatArray:
    """Share of hearts that the model describes, by volume, whose echo had the repeatability's error."""
    rng = np.random.default_rng(12)
    config = speed_case.shipped()
    population = config.population_experiments["amortised"].population
    drawn = draw_population(range(6 * hearts), population, 1, "volumes")
    flags = []
    for one in [one for one in drawn if one.group == group][:hearts]:
        truth = quantile(rng.random((1, 3)), config.priors["calibrated"])[0]
        seen = truth * np.exp(SPREAD[:3] * rng.standard_normal(3))
        own = model_of(one.context).simulate(np.array([[*truth, 2.2]])).end_systolic_volume_ml[0]
        context = replace(one.context, lvesv_ml=float(own * (1.0 + ECHO_SD * rng.standard_normal())))
        phi = np.clip(posterior_about(tuple(seen), int(rng.integers(1000)), 50), 0.2, 250.0)
        flags.append([test.flagged for test in judged(context, phi)])
    return np.mean(flags, axis=0)


@pytest.mark.parametrize("group", ["adults", "children", "dilated"])
def test_hearts_that_the_model_describes_raise_an_alarm_no_oftener_than_is_said(group: str) -> None:
    rates = false_alarms(group, 120)
    # Three standard errors of a share of 1 % in 120 hearts.
    assert rates.sum() <= SETTINGS.doubtful_level + 3.0 * np.sqrt(0.01 / 120)


def test_limits_follow_the_level_and_must_ascend() -> None:
    plain = SETTINGS.to_plain()
    assert SETTINGS.doubtful_abs_z == pytest.approx(3.023, abs=1e-3)
    with pytest.raises(ValidationError, match="must be below contradicted_abs_z = 2.5"):
        VolumeSettings.from_plain(plain | {"contradicted_abs_z": 2.5})
