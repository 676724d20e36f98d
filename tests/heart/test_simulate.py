from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from forward_model_cases import COHORT, SETTINGS, prior_draws
from pydantic import ValidationError

from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import simulate

CENTRE = np.array([[45.0, 5.0, 30.0]])


def test_result_depends_on_own_theta_only() -> None:
    theta = prior_draws(75, seed=7)
    together = simulate(theta, COHORT["B"], SETTINGS).active_stiffness_kpa
    alone = np.concatenate([simulate(row[None], COHORT["B"], SETTINGS).active_stiffness_kpa for row in theta])
    backwards = simulate(theta[::-1], COHORT["B"], SETTINGS).active_stiffness_kpa[::-1]
    np.testing.assert_array_equal(together, alone)
    np.testing.assert_array_equal(together, backwards)


@pytest.mark.parametrize(
    "theta", [[[45.0, 5.0]], [[np.nan, 5.0, 30.0]], [[45000.0, 5.0, 30.0]], np.empty((0, 3))]
)
def test_wrong_theta_is_refused(theta: list[list[float]]) -> None:
    with pytest.raises(ValueError, match="theta"):
        simulate(np.asarray(theta), COHORT["A"], SETTINGS)


@pytest.mark.parametrize(
    ("name", "value"), [("hr_bpm", 1.1), ("lvedv_ml", 1180.0), ("ivsd_cm", float("nan"))]
)
def test_wrong_context_is_refused_by_name(name: str, value: float) -> None:
    context = dataclasses.replace(COHORT["A"], **{name: value})
    with pytest.raises(ValueError, match=name):
        simulate(CENTRE, context, SETTINGS)


def test_inconsistent_wall_thickness_is_refused() -> None:
    context = dataclasses.replace(COHORT["A"], ivsd_cm=2.9, lvedv_ml=20.0)
    with pytest.raises(ValueError, match=r"ivsd_cm.*lvedv_ml"):
        simulate(CENTRE, context, SETTINGS)


def test_option_without_its_value_is_refused() -> None:
    plain = SETTINGS.to_plain() | {"circulation": "open"}
    with pytest.raises(ValidationError, match="atrial_pressure_pa is missing; circulation: open needs it"):
        ForwardModelSettings.from_plain(plain)


def test_samples_that_do_not_divide_the_steps_are_refused() -> None:
    with pytest.raises(ValidationError, match="samples_per_beat = 300"):
        ForwardModelSettings.from_plain(SETTINGS.to_plain() | {"samples_per_beat": 300})
