"""The incremental modulus of a wall's energy against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from other_hearts_case import CONFIG

from swesbi.heart.settings import ForwardModelSettings
from swesbi.virtual.hearts.passive import (
    MATCHED_STRETCHES,
    acoustoelastic_kpa,
    incremental_modulus_kpa,
    mooney_rivlin_wall,
    parabola,
    powers,
    recruited,
    wall_stress_pa,
)

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


def test_a_shear_wave_in_a_mooney_rivlin_wall_meets_its_own_law() -> None:
    """3 rho c^2 = 6 lambda^2 (W_1 + W_2 lambda^2), of W' = 4 (lambda - lambda^-5) (W_1 + lambda^2 W_2).

    At rest the law has a limit, which is taken beside it.
    """
    wall = changed(passive_law="mooney_rivlin", passive_c0_pa=2000.0, passive_c2_pa=500.0)
    expected = 6.0 * STRETCH**2 * (2.0 + 0.5 * STRETCH**2)
    moved = STRETCH != 1.0
    found = acoustoelastic_kpa(STRETCH, wall)
    np.testing.assert_allclose(found[moved], expected[moved], rtol=1e-10)
    np.testing.assert_allclose(found[~moved], expected[~moved], rtol=1e-3)


def test_at_rest_a_wave_meets_young_s_modulus() -> None:
    rest = np.array([1.0])
    for wall in (
        EXPONENTIAL,
        changed(passive_law="mooney_rivlin", passive_c0_pa=2000.0, passive_c2_pa=500.0),
    ):
        np.testing.assert_allclose(
            acoustoelastic_kpa(rest, wall), incremental_modulus_kpa(rest, wall), rtol=2e-3
        )


def test_recruited_collagen_bears_in_stretch_and_the_matrix_in_compression() -> None:
    stretch, strain = STRETCH, STRETCH**2 - 1.0
    assert recruited(np.array([1.0]), 8.0, 0.4, 5.0)[0] == 1.0
    matrix, collagen = recruited(stretch, 8.0, 0.0, 5.0), recruited(stretch, 8.0, 1.0, 5.0)
    np.testing.assert_allclose(matrix, np.where(strain < 0.0, 1.0 - 5.0 * strain, 1.0), rtol=1e-14)
    np.testing.assert_allclose(collagen, np.where(strain > 0.0, np.exp(8.0 * strain), 1.0), rtol=1e-14)
    np.testing.assert_allclose(recruited(stretch, 8.0, 0.4, 5.0), 0.6 * matrix + 0.4 * collagen, rtol=1e-14)


def test_a_parabola_is_one_where_it_is_softest_and_rises_alike_on_both_sides() -> None:
    beside = 0.97 + np.array([-0.1, 0.0, 0.1])
    np.testing.assert_allclose(parabola(beside, 0.97, 50.0), [1.5, 1.0, 1.5], rtol=1e-13)


def test_powers_are_of_stretch_and_of_its_inverse() -> None:
    assert powers(np.array([1.0]), 9.0, 5.0, 0.7)[0] == pytest.approx(1.7)
    np.testing.assert_allclose(powers(STRETCH, 9.0, 5.0, 0.0), STRETCH**9, rtol=1e-14)
    # a wall of inverse powers takes compression for stretch
    np.testing.assert_allclose(
        powers(1.0 / STRETCH, 9.0, 5.0, 0.5), 0.5 * powers(STRETCH, 5.0, 9.0, 2.0), rtol=1e-13
    )
