"""Both arms of a person of a bank: one heart, one day, one noise, and the effect between them."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from study_copy import ROOT

from swesbi.config.read import read_merged
from swesbi.config.study import load_study
from swesbi.persons.planning.effect import Effect
from swesbi.persons.planning.simulation import BankSettings, PlannedPerson, draw_planned
from swesbi.persons.settings import GROUPS, PAIRED
from swesbi.study.plan import PlanRequest, bank_settings


@cache
def person(design: str, change: float) -> PlannedPerson:
    """Draw the first person of a bank by the shipped configuration."""
    study = load_study(read_merged(ROOT / "config.yaml"))
    effect = Effect("k_sr_per_s", change)
    asked = PlanRequest(effect, design, (3,), 0.03, 0.9, None)
    settings = BankSettings.from_plain(bank_settings(study, "amortised", asked, 3))
    return draw_planned(0, design, effect, 0.0, settings.source(study.config.seed))


@pytest.mark.parametrize("design", [PAIRED, GROUPS])
def test_without_an_effect_both_arms_are_one_recording(design: str) -> None:
    drawn = person(design, 0.0)
    assert (drawn.earlier is None) == (design == GROUPS)
    assert (drawn.truth[0] == drawn.truth[1]).all()
    without, other = drawn.arms
    assert without.context.hr_bpm == other.context.hr_bpm
    assert without.context.lvesv_ml == other.context.lvesv_ml
    assert (without.speed_m_s == other.speed_m_s).all()


def test_an_effect_is_all_that_lies_between_the_arms() -> None:
    drawn = person(PAIRED, -0.2)
    assert drawn.truth[1] / drawn.truth[0] == pytest.approx([1.0, 1.0, 0.8])
    assert (drawn.truth[0] == person(PAIRED, 0.0).truth[0]).all()
    without, other = drawn.arms
    assert without.context.hr_bpm == other.context.hr_bpm
    assert not np.allclose(without.speed_m_s, other.speed_m_s, rtol=0.002)
    # what failed in one failed in the other; of outliers one or another may be told apart in one alone
    assert np.abs(without.samples_by_repeat - other.samples_by_repeat).sum() <= 3
    assert drawn.earlier is not None
    assert not np.allclose(without.speed_m_s, drawn.earlier.speed_m_s, rtol=0.002)


def test_a_bank_depends_on_what_is_planned_and_on_what_answers_do() -> None:
    study = load_study(read_merged(ROOT / "config.yaml"))
    asked = PlanRequest(Effect("k_sr_per_s", -0.2), PAIRED, (3, 5), 0.03, 0.9, None)
    parts = bank_settings(study, "amortised", asked, 3)
    assert (parts["change"], parts["repeats"], parts["repeat_noise"]) == (-0.2, 3, 0.03)
    assert parts["exact"] == study.config.speed_experiments["calibrated"].exact.to_plain()
    assert parts["persons"] == study.config.plan.persons.to_plain()
