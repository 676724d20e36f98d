"""The incremental modulus of a wall's energy against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from validation_case import CONFIG

from studies.validation.hearts.passive import (
    MATCHED_STRETCHES,
    incremental_modulus_kpa,
    mooney_rivlin_wall,
    wall_stress_pa,
)
from swesbi.heart.settings import ForwardModelSettings

STRETCH = np.array([0.8, 0.9, 1.0, 1.1, 1.25])
EXPONENTIAL = CONFIG.forward_model


def changed(**values: object) -> ForwardModelSettings:
    return ForwardModelSettings.from_plain({**EXPONENTIAL.to_plain(), **values})


def test_a_neo_hookean_wall_has_six_times_its_modulus_at_rest_and_its_own_law_elsewhere() -> None:
    """W' = 4 W_1 (lambda - lambda^-5), so E = W_1 (2 lambda^2 + 4 lambda^-4)."""
    wall = changed(passive_law="mooney_rivlin", passive_c0_pa=2000.0, passive_c2_pa=0.0)
    expected = 2.0 * (2.0 * STRETCH**2 + 4.0 * STRETCH**-4)
    np.testing.assert_allclose(incremental_modulus_kpa(STRETCH, wall), expected, rtol=1e-8)
    assert incremental_modulus_kpa(np.array([1.0]), wall)[0] == pytest.approx(12.0)


def test_the_second_modulus_adds_its_own_law() -> None:
    """Of W_2: W' = 4 W_2 (lambda^3 - lambda^-3), so E = W_2 (4 lambda^4 + 2 lambda^-2)."""
    one, two = (
        changed(passive_law="mooney_rivlin", passive_c0_pa=1000.0, passive_c2_pa=value)
        for value in (0.0, 500.0)
    )
    added = incremental_modulus_kpa(STRETCH, two) - incremental_modulus_kpa(STRETCH, one)
    np.testing.assert_allclose(added, 0.5 * (4.0 * STRETCH**4 + 2.0 * STRETCH**-2), rtol=1e-7)


def test_the_fibres_alone_bear_an_exponential_wall_at_rest() -> None:
    """J and its derivative vanish at 1, so E(1) = W''(1) / 4 = 2 C_2 C_3."""
    expected = 2e-3 * EXPONENTIAL.passive_c2_pa * EXPONENTIAL.passive_c3
    assert incremental_modulus_kpa(np.array([1.0]), EXPONENTIAL)[0] == pytest.approx(expected, rel=1e-6)


def test_a_mooney_rivlin_wall_bears_what_the_own_one_does_in_the_geometric_mean() -> None:
    at = np.array(MATCHED_STRETCHES)
    made = changed(**mooney_rivlin_wall(EXPONENTIAL))
    ratio = wall_stress_pa(at, made, "mooney_rivlin") / wall_stress_pa(at, EXPONENTIAL, "exponential")
    assert np.exp(np.log(ratio).mean()) == pytest.approx(1.0)
    assert ratio.max() < 3.0
