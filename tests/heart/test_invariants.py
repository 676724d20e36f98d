"""What must hold whatever the parameters: conservation, periodicity, order of convergence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from forward_model_cases import COHORT, RICHER, SETTINGS, prior_draws

from swesbi.heart.model import Model, build_model, cavity_volume, total_volume
from swesbi.heart.periodic import Status, advance, run_to_periodic, state_scale
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import simulate

SI = np.array([1e3, 1.0, 1.0])
TIGHT = {"periodicity_tolerance": 1e-9, "maximum_beats": 300}


def volume_drift_ml(steps: int, beats: int = 20) -> float:
    settings = SETTINGS.model_copy(update={"steps_per_beat": steps, "maximum_step_s": 1.0})
    model = build_model(COHORT["A"], settings)
    theta = prior_draws(200, seed=1) * SI
    x = np.repeat(model.start[None], 200, axis=0)
    before = total_volume(x, model)
    for _ in range(beats):
        x, _ = advance(x, theta, model)
    return float(1e6 * np.abs(total_volume(x, model) - before).max())


def test_total_volume_is_conserved() -> None:
    at_shipped_step, finer = volume_drift_ml(400), volume_drift_ml(800)
    print(f"drift over 20 beats, 200 draws: {at_shipped_step:.1e} mL at 400 steps, {finer:.1e} mL at 800")
    assert at_shipped_step <= 1e-2
    assert finer < at_shipped_step / 2**4


@pytest.mark.parametrize("settings", [SETTINGS, RICHER], ids=["resistive", "inertance"])
@pytest.mark.parametrize("subject", COHORT)
def test_valves_let_nothing_back(settings: ForwardModelSettings, subject: str) -> None:
    beats = simulate(prior_draws(100, seed=2), COHORT[subject], settings)
    assert (beats.status == Status.PERIODIC).all()
    assert beats.aortic_flow_ml_s.min() >= 0.0
    assert beats.mitral_flow_ml_s.min() >= 0.0
    net = (beats.mitral_flow_ml_s - beats.aortic_flow_ml_s).mean(axis=1) * COHORT[subject].period_s
    stroke = beats.end_diastolic_volume_ml - beats.end_systolic_volume_ml
    # the flows' short peaks, summed over 200 samples a beat
    np.testing.assert_allclose(net / stroke, 0.0, atol=2e-2)


def state_at_r_peak(model: Model, record: np.ndarray) -> np.ndarray:
    """Rebuild the state from the first recorded point; the loop's volume gives the pulmonary pressure."""
    y, stiffness, arterial, _, _, _, stress = record[:, :, 0]
    p = model.parameters
    rest = total_volume(model.start[None], model) - cavity_volume(1.0 + y / p.radius, model)
    pulmonary = (rest - p.c_systemic * arterial) / p.c_pulmonary
    zero = np.zeros_like(y)
    return np.stack([y, stiffness, stress, arterial, pulmonary, zero, zero, zero + model.start[7]], axis=1)


@pytest.mark.parametrize("subject", ["A", "F"])
def test_two_further_beats_change_nothing(subject: str) -> None:
    model = build_model(COHORT[subject], SETTINGS)
    theta = prior_draws(200, seed=3) * SI
    tolerance = SETTINGS.periodicity_tolerance
    records = run_to_periodic(theta, model, tolerance, 100, SETTINGS.extrapolation_memory)
    x = state_at_r_peak(model, records.values)
    for _ in range(3):
        x, later = advance(x, theta, model)
    scale = state_scale(model)[[0, 1, 3], None]
    change = np.abs(later[:3] - records.values[:3]).max(axis=2) / scale
    print(f"largest relative change over two further beats: {change.max():.1e}")
    assert change.max() <= 5.0 * tolerance


def test_extrapolation_finds_the_state_that_beats_lead_to() -> None:
    theta = prior_draws(200, seed=4)
    for subject in ("B", "E"):
        runs = [
            simulate(
                theta, COHORT[subject], SETTINGS.model_copy(update=TIGHT | {"extrapolation_memory": memory})
            )
            for memory in (0, 2)
        ]
        assert all((run.status == Status.PERIODIC).all() for run in runs)
        np.testing.assert_allclose(runs[0].volume_ml, runs[1].volume_ml, atol=2e-6)
        np.testing.assert_allclose(runs[0].active_stiffness_kpa, runs[1].active_stiffness_kpa, atol=1e-6)
        assert runs[1].beats.mean() < 0.5 * runs[0].beats.mean()


def smooth_run(steps: int) -> np.ndarray:
    """Return the end of a beat without kinks: contraction only, no valve, a net flow that only fills."""
    settings = SETTINGS.model_copy(
        update={
            "steps_per_beat": steps,
            "samples_per_beat": 50,
            "maximum_step_s": 1.0,
            "length_dependence": 0.0,
        }
    )
    model = build_model(COHORT["A"], settings)
    t = np.linspace(0.0, model.period_s, model.drives.shape[0])
    drives = model.drives.copy()
    drives[:, 0] = 0.75 - 0.25 * np.cos(2 * np.pi * t / model.period_s)
    drives[:, 3] = 1e-4 * (1.0 + 0.5 * np.sin(2 * np.pi * t / model.period_s))
    model = replace(model, drives=drives, options=model.options._replace(prescribed_flow=True))
    after, _ = advance(model.start[None], np.array([[45e3, 40.0, 30.0]]), model)
    return after[0, [0, 1, 2]] / state_scale(model)[[0, 1, 2]]


def test_scheme_is_of_fourth_order_where_the_solution_is_smooth() -> None:
    exact = smooth_run(6400)
    errors = np.array([np.abs(smooth_run(steps) - exact).max() for steps in (100, 200)])
    order = np.log2(errors[0] / errors[1])
    print(f"observed order {order:.2f}, errors {errors}")
    assert 3.5 < order < 5.0


def test_kinks_leave_second_order() -> None:
    """Opening valves and the turn of contraction into relaxation are kinks of the right-hand side."""
    theta = prior_draws(100, seed=5)
    steps = (200, 400, 800)
    runs = [
        simulate(
            theta,
            COHORT["C"],
            SETTINGS.model_copy(update=TIGHT | {"steps_per_beat": n, "maximum_step_s": 1.0}),
        )
        for n in (*steps, 6400)
    ]
    exact = runs[-1].active_stiffness_kpa
    peak = exact.max(axis=1)
    errors = [np.median(np.abs(run.active_stiffness_kpa - exact).max(axis=1) / peak) for run in runs[:-1]]
    order = np.log2(errors[0] / errors[-1]) / 2
    print(f"median errors of k_c {errors}, observed order {order:.2f}")
    assert order > 1.7
