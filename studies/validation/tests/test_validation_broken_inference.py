"""The validation's figures fall where the inference is broken on purpose; asked of hearts of development."""

from __future__ import annotations

from typing import Final

import pytest
from broken_inference import DOUBTFUL, NOISE, Hearts, answers, asked, at_bounds, covered, not_contradicted

from swesbi.measurement.speeds import measured_speeds
from swesbi.report.tables.validation import K_SR, OF_EVERY_GENERATOR

SHOWN: Final = OF_EVERY_GENERATOR[0]
ORDINARY: Final[Hearts] = [(letter, number) for letter in "ab" for number in range(6)]
SOFT: Final[Hearts] = [("soft", number) for number in range(1, 5)]
LENGTH: Final[Hearts] = [("length", 4)]
"""A heart that ejects 70 % of its volume, so that its bonds depend much on length."""
AT_BOUND: Final = 2.26
"""Posterior over prior mass beside a bound, from which a heart presses on it."""
OTHER_BONDS: Final = 9
"""Number of a stored heart of (f) of development whose residuals are as they should be."""


@pytest.mark.slow(minutes=0.4)
def test_the_intact_inference_covers_shown_stiffness_and_k_sr() -> None:
    """90 % intervals cover fewer than 9 of 12 hearts once in 40 times."""
    made = answers("intact", ORDINARY)
    assert all(one.converged for one in made)
    assert not_contradicted(made) >= 11
    assert min(covered(made, name) for name in OF_EVERY_GENERATOR) >= 9


@pytest.mark.slow(minutes=0.3)
def test_a_wall_that_cannot_soften_is_contradicted_by_walls_that_do_or_misses_them() -> None:
    fixed, intact = answers("fixed wall", SOFT), answers("intact", SOFT)
    assert not_contradicted(intact) == len(SOFT)
    assert covered(intact, K_SR) >= 3
    assert sum(one.not_contradicted and not one.missed for one in fixed) <= 1


@pytest.mark.slow(minutes=0.2)
def test_without_length_dependence_a_heart_that_has_it_is_contradicted_and_missed() -> None:
    (without,), (intact,) = answers("no length dependence", LENGTH), answers("intact", LENGTH)
    assert without.missed and not without.not_contradicted
    assert intact.not_contradicted and not intact.missed


@pytest.mark.slow(minutes=0.2)
def test_wrong_nuisances_contradict_the_model_or_miss() -> None:
    hearts = [heart for heart in ORDINARY if heart[1] < 4]
    made = answers("wrong nuisances", hearts)
    assert not_contradicted(made) <= len(hearts) // 2
    assert sum(one.not_contradicted and not one.missed for one in made) <= 1


@pytest.mark.slow(minutes=0.5)
def test_a_hidden_scale_misses_shown_stiffness_and_nothing_contradicts_it() -> None:
    """90 % intervals cover 8 of 14 hearts, or fewer, once in 700 times."""
    hearts = [(letter, number) for letter in "ab" for number in range(2, 9)]
    made = answers("hidden scale", hearts)
    assert not_contradicted(made) >= 13
    assert covered(made, SHOWN) <= 8


@pytest.mark.slow(minutes=0.1)
def test_without_strips_at_their_bounds_a_heart_of_other_bonds_goes_unnoticed() -> None:
    """Its length dependence presses on the upper bound, and nothing else speaks against the model."""
    made = asked("f", OTHER_BONDS, "development", 20260)
    with_strips, without, p_value = at_bounds(measured_speeds(made.observation, NOISE))
    assert p_value >= DOUBTFUL
    assert with_strips >= AT_BOUND > without
