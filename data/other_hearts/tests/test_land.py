"""The bridges of Land et al. (2017) against what the paper says of them; their heart against mechanics."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from data.other_hearts.land import (
    RELAXED,
    Bridges,
    CalciumTransient,
    LandParameters,
    bond_stiffness_kpa,
    bridge_rates,
    overlap,
    steady_tension_kpa,
    tension_kpa,
)
from data.other_hearts.land_heart import LandHeart, land_beat
from studies.validation.hearts.beat import Beat
from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.heart.settings import ForwardModelSettings
from swesbi.virtual.volunteers import COMMON

INTACT = LandParameters()
# The other column of the table of Land et al. (2017), Appendix B: skinned cells.
SKINNED = LandParameters(ca50_um=2.5, n_tm=2.2, nu=1.0, mu=1.0, t_ref_kpa=40.5)
# Land et al. (2017), Fig. 6 and its text: the isometric twitch of intact muscle at rest length and 1 Hz.
PUBLISHED_PEAK_KPA, PUBLISHED_LEAST_KPA = 51.0, 0.078
PUBLISHED_RT50_S, PUBLISHED_RT95_S = 0.121, 0.281


def held(calcium_um: float, start: Bridges = RELAXED, duration_s: float = 20.0) -> Bridges:
    solved = solve_ivp(
        lambda _, x: bridge_rates(Bridges(*x), calcium_um, 1.0, 0.0, INTACT),
        (0.0, duration_s),
        start,
        method="LSODA",
        rtol=1e-9,
        atol=1e-12,
    )
    return Bridges(*solved.y[:, -1])


def twitch(law: LandParameters, beats: int = 4) -> tuple[FloatArray, FloatArray]:
    """Return times (s) and tension (kPa) of the last isometric beat at rest length and 1 Hz."""
    time_s, calcium, state = np.linspace(0.0, 1.0, 1001), CalciumTransient(), np.array(RELAXED)
    for _ in range(beats):
        solved = solve_ivp(
            lambda t, x: bridge_rates(Bridges(*x), calcium.at(t, 1.0), 1.0, 0.0, law),
            (0.0, 1.0),
            state,
            method="LSODA",
            t_eval=time_s,
            rtol=1e-7,
            atol=1e-10,
        )
        state = solved.y[:, -1]
    return time_s, np.array([tension_kpa(Bridges(*column), 1.0, law) for column in solved.y.T])


def test_isometric_twitch_is_the_published_one() -> None:
    time_s, tension = twitch(INTACT)
    peak, least = tension.argmax(), tension.min()
    falls_to = [least + share * (tension[peak] - least) for share in (0.5, 0.05)]
    relaxed_s = [time_s[peak:][tension[peak:] < level][0] - time_s[peak] for level in falls_to]
    assert tension[peak] == pytest.approx(PUBLISHED_PEAK_KPA, abs=1.0)
    assert least == pytest.approx(PUBLISHED_LEAST_KPA, abs=0.01)
    assert relaxed_s == pytest.approx([PUBLISHED_RT50_S, PUBLISHED_RT95_S], abs=0.008)


@pytest.mark.parametrize("calcium_um", [0.45, 0.59, 0.9, 5.0])
def test_constant_calcium_leads_to_the_steady_tension(calcium_um: float) -> None:
    steady = tension_kpa(held(calcium_um), 1.0, INTACT)
    assert steady == pytest.approx(float(steady_tension_kpa(np.array(calcium_um), INTACT)), rel=1e-5)


@pytest.mark.parametrize(("law", "half_um", "hill"), [(INTACT, 0.5907, 6.5), (SKINNED, 1.8345, 2.86)])
def test_force_and_calcium(law: LandParameters, half_um: float, hill: float) -> None:
    """Half of T_ref at CaTRPN = TRPN50; a Hill coefficient there of n_Tm n_TRPN (1 - TRPN50)."""
    around = steady_tension_kpa(half_um * np.array([0.999, 1.0, 1.001, 1e3]), law) / law.t_ref_kpa
    logit = np.log(around[:3] / (1.0 - around[:3]))
    assert around[1] == pytest.approx(0.5, abs=1e-3)
    assert around[3] == pytest.approx(1.0 / (1.0 + law.trpn50**law.n_tm), abs=1e-4)
    assert (logit[2] - logit[0]) / np.log(1.001 / 0.999) == pytest.approx(hill, rel=1e-3)


def test_shares_of_attached_bridges_at_saturation() -> None:
    saturated = held(1e3)
    assert saturated.strong == pytest.approx(INTACT.r_s * (1.0 - saturated.blocked), rel=1e-6)
    assert saturated.weak == pytest.approx(
        (1.0 - INTACT.r_s) * INTACT.r_w * (1.0 - saturated.blocked), rel=1e-6
    )


def test_bond_stiffness_is_what_a_quick_stretch_meets() -> None:
    active = held(0.7)
    stretch_by, duration_s = 1e-4, 1e-6
    solved = solve_ivp(
        lambda _, x: bridge_rates(Bridges(*x), 0.7, 1.0, stretch_by / duration_s, INTACT),
        (0.0, duration_s),
        active,
        rtol=1e-10,
        atol=1e-14,
    )
    pulled = tension_kpa(Bridges(*solved.y[:, -1]), 1.0, INTACT) - tension_kpa(active, 1.0, INTACT)
    stiffness = bond_stiffness_kpa(active, 1.0, INTACT)
    assert pulled / stretch_by == pytest.approx(stiffness, rel=1e-3)
    assert stiffness == pytest.approx(INTACT.a_eff * tension_kpa(active, 1.0, INTACT), rel=1e-6)


def test_overlap() -> None:
    assert overlap(1.0, INTACT) == pytest.approx(1.0)
    assert overlap(0.8, INTACT) == pytest.approx(1.0 + 2.3 * (1.6 - 1.87))
    assert overlap(1.5, INTACT) == overlap(1.2, INTACT)
    assert overlap(0.3, INTACT) == 0.0


def test_calcium_is_continuous_and_periodic() -> None:
    calcium = CalciumTransient(onset_s=0.02)
    assert calcium.at(0.02 - 1e-9, 0.6) == pytest.approx(calcium.at(0.02, 0.6), rel=1e-3)
    assert calcium.at(0.1, 0.6) == pytest.approx(calcium.at(0.7, 0.6), rel=1e-9)
    assert calcium.at(0.02 + calcium.time_to_peak_s, 10.0) == pytest.approx(0.593)


CONTEXT = Context("T", "F", 40.0, 1.7, 65.0, 90.0, 35.0, 0.85)
SETTINGS = ForwardModelSettings.from_plain(
    {**COMMON, "valves": "resistive", "wall_inertia": False, "steps_per_beat": 400, "samples_per_beat": 200}
)
HEART = LandHeart(INTACT, CalciumTransient(onset_s=0.02), 1.0 / 70.0, SETTINGS)


@cache
def published_beat() -> Beat:
    return land_beat(HEART, CONTEXT)


def test_the_heart_beats() -> None:
    beat = published_beat()
    assert 0.4 < beat.ejection_fraction < 0.7
    assert 50.0 < beat.arterial_mmhg.min() < beat.arterial_mmhg.max() < beat.ventricular_mmhg.max() < 130.0
    assert 20.0 < beat.active_kpa.max() < 60.0
    shown_twice = land_beat(replace(HEART, wave_share=2.0 / 70.0), CONTEXT)
    assert np.array_equal(shown_twice.stretch, beat.stretch)
    assert shown_twice.active_kpa == pytest.approx(2.0 * beat.active_kpa)


def test_what_leaves_the_ventricle_flows_through_the_arteries() -> None:
    """Over a periodic beat the stroke volume is the mean systemic flow times the period."""
    beat = published_beat()
    stroke_ml = beat.volume_ml.max() - beat.volume_ml.min()
    resistance = SETTINGS.distal_resistance_pa_s_m3 + SETTINGS.pulmonary_resistance_pa_s_m3
    arterial_pa = 133.322 * beat.arterial_mmhg.mean()
    pulmonary_pa = arterial_pa - 1e-6 * stroke_ml / CONTEXT.period_s * resistance
    # The pulmonary pressure that this implies is the one at which the ventricle fills: its own in diastole.
    filling_pa = 133.322 * beat.ventricular_mmhg[(beat.phase > 0.7) & (beat.phase < 0.98)].mean()
    assert pulmonary_pa == pytest.approx(filling_pa, rel=0.15)


def test_an_open_circulation_is_refused() -> None:
    settings = {
        **SETTINGS.to_plain(),
        "circulation": "open",
        "atrial_pressure_pa": 1e3,
        "venous_pressure_pa": 1e3,
    }
    heart = replace(HEART, settings=ForwardModelSettings.from_plain(settings))
    with pytest.raises(ValueError, match="closed circulation"):
        land_beat(heart, CONTEXT)
