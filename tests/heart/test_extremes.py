"""Any input inside the declared ranges ends in a periodic beat or in a named status."""

from __future__ import annotations

import numpy as np
import pytest
from forward_model_cases import RICHER, SETTINGS

from swesbi.context import CONTEXT_RANGES, RELATIVE_THICKNESS_RANGE, Context
from swesbi.heart.periodic import Status
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import simulate

LOW, HIGH = np.array([10.0, 2.0, 2.0]), np.array([200.0, 250.0, 120.0])
PER_CONTEXT = 20


def extreme_context(rng: np.random.Generator) -> Context:
    while True:
        hr, lvedv, ivsd = (
            float(np.exp(rng.uniform(*np.log(CONTEXT_RANGES[name]))))
            for name in ("hr_bpm", "lvedv_ml", "ivsd_cm")
        )
        context = Context("X", "F", 30, 1.9, hr, lvedv, 0.4 * lvedv, ivsd)
        if RELATIVE_THICKNESS_RANGE[0] < context.thickness_m / context.radius_m < RELATIVE_THICKNESS_RANGE[1]:
            return context


def extreme_theta(rng: np.random.Generator) -> np.ndarray:
    """Log-uniform in the widest prior of the study, a third of the entries on its bounds."""
    theta = np.exp(rng.uniform(np.log(LOW), np.log(HIGH), (PER_CONTEXT, 3)))
    bound = np.where(rng.random(theta.shape) < 0.5, LOW, HIGH)
    return np.where(rng.random(theta.shape) < 0.3, bound, theta)


def statuses(n: int, settings: ForwardModelSettings) -> np.ndarray:
    rng = np.random.default_rng(11)
    out = []
    for _ in range(n // PER_CONTEXT):
        beats = simulate(extreme_theta(rng), extreme_context(rng), settings)
        failed = beats.status != Status.PERIODIC
        assert np.isnan(beats.active_stiffness_kpa[failed]).all()
        assert np.isfinite(beats.active_stiffness_kpa[~failed]).all()
        out.append(beats.status)
    return np.concatenate(out)


@pytest.mark.parametrize("settings", [SETTINGS, RICHER], ids=["resistive", "inertance"])
@pytest.mark.parametrize("n", [1_000, pytest.param(10_000, marks=pytest.mark.exhaustive)])
def test_extreme_draws(n: int, settings: ForwardModelSettings) -> None:
    status = statuses(n, settings)
    counts = {Status(value).name: int((status == value).sum()) for value in np.unique(status)}
    print(f"{n} extreme draws: {counts}")
    assert (status == Status.PERIODIC).mean() >= 0.99


SOFT = {"passive_c0_pa": 0.1, "passive_c1": 0.1, "passive_c2_pa": 50.0, "passive_c3": 0.1}


@pytest.mark.parametrize(
    ("update", "status"),
    [
        (SOFT | {"initial_pulmonary_pressure_pa": 2e4}, Status.OUT_OF_RANGE),
        ({"sigma_0_pa": 2e6}, Status.NON_FINITE),
        ({"maximum_beats": 2}, Status.NOT_PERIODIC),
    ],
    ids=["a soft wall stretched beyond twofold", "a wall too strong for any step", "too few beats"],
)
def test_failures_are_named(update: dict[str, object], status: Status) -> None:
    context = Context("X", "F", 30, 1.9, 60, 118, 45, 0.9)
    beats = simulate(np.array([[45.0, 5.0, 30.0]]), context, SETTINGS.model_copy(update=update))
    assert Status(beats.status[0]) is status
    for curve in (beats.active_stiffness_kpa, beats.volume_ml, beats.ventricular_pressure_mmhg):
        assert np.isnan(curve).all()
