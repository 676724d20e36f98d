from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from forward_model_cases import COHORT, SETTINGS
from numpy.typing import NDArray

from swesbi.heart.beats import aortic_pressure_mmhg, systolic_intervals
from swesbi.heart.simulate import ML_PER_M3, PA_PER_MMHG, Beats, simulate

CENTRE = np.array([[45.0, 5.0, 30.0]])
BEAT = simulate(CENTRE, COHORT["A"], SETTINGS)
SAMPLES = BEAT.cycle_phase.size
PERIOD_S = SAMPLES * 1e-3  # a sample is a millisecond


def open_at(*stretches: tuple[int, int]) -> NDArray[np.float64]:
    """A flow of 1 in these stretches of the cycle, the end excluded; they may go beyond it."""
    flow = np.zeros(SAMPLES)
    for start, end in stretches:
        flow[np.arange(start, end) % SAMPLES] = 1.0
    return flow[None]


def with_flows(aortic: NDArray[np.float64], mitral: NDArray[np.float64], bonds: int = 0) -> Beats:
    """A beat with these flows, whose bonds form from this sample on for half of the cycle."""
    active = 1.0 - np.abs((np.arange(SAMPLES) - bonds) % SAMPLES / SAMPLES * 2.0 - 1.0)
    return replace(BEAT, aortic_flow_ml_s=aortic, mitral_flow_ml_s=mitral, active_stiffness_kpa=active[None])


@pytest.mark.parametrize(("bonds", "contraction_ms"), [(-10, 10.0), (5, 10.0), (13, 7.0)])
@pytest.mark.parametrize("shift", [0, 45, 130])
def test_ejection_lasts_until_the_valve_closes_for_good(
    shift: int, bonds: int, contraction_ms: float
) -> None:
    """Contraction begins with the later of the mitral valve's closing, at 10, and the first bonds."""
    stretches = [(20, 30), (33, 60), (61, 80)]
    moved = open_at(*((start + shift, end + shift) for start, end in stretches))
    beat = with_flows(moved, open_at((90 + shift, 210 + shift)), bonds + shift)
    times = systolic_intervals(beat, PERIOD_S)
    assert 1e3 * times.ejection_s[0] == pytest.approx(60.0)
    assert 1e3 * times.isovolumic_relaxation_s[0] == pytest.approx(10.0)
    assert 1e3 * times.isovolumic_contraction_s[0] == pytest.approx(contraction_ms)


def test_a_valve_that_never_closes_ejects_all_the_time_and_one_that_never_opens_not_at_all() -> None:
    always = systolic_intervals(with_flows(open_at((0, SAMPLES)), open_at((0, 10))), PERIOD_S)
    assert always.ejection_s[0] == pytest.approx(PERIOD_S)
    never = systolic_intervals(with_flows(np.zeros((1, SAMPLES)), open_at((0, 10))), PERIOD_S)
    assert np.isnan(never.ejection_s[0])


def test_the_valve_lies_between_the_pressure_of_the_ventricle_and_that_of_the_aorta() -> None:
    flow = BEAT.aortic_flow_ml_s
    resistance = SETTINGS.aortic_resistance_pa_s_m3 / PA_PER_MMHG / ML_PER_M3
    aorta, opened = aortic_pressure_mmhg(BEAT, SETTINGS), flow > 0.0
    across = BEAT.ventricular_pressure_mmhg - resistance * flow
    np.testing.assert_allclose(aorta[opened], across[opened], rtol=1e-6)
    assert (aorta[~opened] >= BEAT.ventricular_pressure_mmhg[~opened]).all()
    assert aorta.max() > BEAT.arterial_pressure_mmhg.max() + 5.0
