from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from forward_model_cases import COHORT, RICHER, SETTINGS, prior_draws
from scipy.integrate import quad

from benchmarks import lsoda
from swesbi.heart.equations import atrial_rise
from swesbi.heart.model import build_model
from swesbi.heart.periodic import Status
from swesbi.heart.physiology import Physiology
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import Beats, simulate


def contracting(settings: ForwardModelSettings, kick_pa: float, delay_s: float) -> ForwardModelSettings:
    return settings.model_copy(update={"atrial_kick_pa": kick_pa, "atrial_delay_s": delay_s})


def beat(kick_pa: float, delay_s: float = 0.13, settings: ForwardModelSettings = SETTINGS) -> Beats:
    return simulate(prior_draws(40, seed=21), COHORT["A"], contracting(settings, kick_pa, delay_s))


@pytest.mark.parametrize("delay_s", [0.0, 0.05, 0.13, 0.2, 0.26])
def test_the_pressure_rises_once_a_beat_from_its_start_on(delay_s: float) -> None:
    """It starts and ends at zero and is symmetric about its height, wherever the R peak falls."""
    model = build_model(COHORT["A"], contracting(SETTINGS, 700.0, delay_s))
    period_s, start_s = model.period_s, delay_s - 0.26

    def rise(time_s: float) -> float:
        return atrial_rise(time_s % period_s, period_s, model.parameters, model.options)

    assert rise(start_s + 0.07) == pytest.approx(700.0)
    assert max(rise(start_s), rise(start_s + 0.14)) == pytest.approx(0.0, abs=1e-9)
    assert rise(start_s + 0.03) == pytest.approx(rise(start_s + 0.11))
    whole = quad(rise, 0.0, period_s, points=sorted({start_s % period_s, (start_s + 0.14) % period_s}))[0]
    assert whole == pytest.approx(700.0 * 0.14 * 8.0 / 15.0)


@pytest.mark.parametrize("settings", [SETTINGS, RICHER], ids=["resistive", "inertance"])
def test_the_ventricle_is_filled_once_more_before_it_contracts(settings: ForwardModelSettings) -> None:
    still, filled = beat(0.0, settings=settings), beat(700.0, settings=settings)
    assert (filled.status == Status.PERIODIC).all()
    late = filled.cycle_phase * COHORT["A"].period_s >= COHORT["A"].period_s - 0.13
    a_wave, before = (beats.mitral_flow_ml_s[:, late].max(axis=1) for beats in (filled, still))
    gained = filled.end_diastolic_volume_ml - still.end_diastolic_volume_ml
    print(f"A wave {np.median(a_wave):.0f} mL/s, of {np.median(before):.0f}; {np.median(gained):.1f} mL more")
    assert (a_wave > 2.0 * before + 50.0).all()
    assert (gained > 0.0).all()


def test_atria_that_do_not_contract_leave_the_beat_as_it_is_to_the_bit() -> None:
    theta, still = prior_draws(40, seed=21), Physiology.of_settings(SETTINGS, 40)
    plain = simulate(theta, COHORT["A"], SETTINGS, still)
    for delay_s in (0.05, 0.26):
        own = simulate(theta, COHORT["A"], SETTINGS, replace(still, atrial_delay_s=np.full(40, delay_s)))
        np.testing.assert_array_equal(own.volume_ml, plain.volume_ml)


@pytest.mark.parametrize("delay_s", [0.13, 0.2])
def test_another_integrator_finds_the_same_beat(delay_s: float) -> None:
    """LSODA, with steps of its own; the later contraction lasts beyond the R peak."""
    tight = SETTINGS.model_copy(update={"periodicity_tolerance": 1e-7, "maximum_beats": 300})
    settings, theta = contracting(tight, 700.0, delay_s), prior_draws(2, seed=21)
    ours = simulate(theta, COHORT["A"], settings).active_stiffness_kpa
    rates = lsoda.compiled_rates(build_model(COHORT["A"], settings).options)
    for row, expected in zip(theta, ours, strict=True):
        found = lsoda.run_to_periodic(row, COHORT["A"], settings, rates, rtol=1e-7).active_stiffness_kpa
        assert np.abs(found - expected).max() < 5e-4 * expected.max()
