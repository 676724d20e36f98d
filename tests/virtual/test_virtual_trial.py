from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from makers import check_made_again, maker
from speed_case import shipped
from study_copy import ROOT

from swesbi.config.read import read_merged
from swesbi.config.study import Study, load_study
from swesbi.context import Context
from swesbi.parameters import PEAK_ACTIVE, THETA_NAMES
from swesbi.recording.cohort.check import examine_cohort
from swesbi.recording.reader import read_samples
from swesbi.virtual import trial as drawing
from swesbi.virtual.trial import (
    AFTER,
    BEFORE,
    GROUPS,
    LOADING,
    SPEED_SCALE,
    TRIAL,
    DrawnAgain,
    TrialSource,
    at_visit,
    draw_person,
    phi_at_visit,
    scale_of_day,
    true_curve,
)

SHIPPED = ROOT / "data" / "virtual_trial"
MAKE = maker("virtual_trial")
MOST_BYTES = 6e6
STILL = {"theta_spread": 0.0, "passive_spread": 0.0, "loading_spread": 0.0, "heart_rate_spread": 0.0}


def table(name: str) -> pd.DataFrame:
    return pd.read_csv(SHIPPED / name)


@cache
def source(**changes: float) -> TrialSource:
    return MAKE.source_of(shipped(), TRIAL.model_copy(update=changes))


@cache
def study() -> Study:
    return load_study(read_merged(ROOT / "config.yaml") | {"cohort": str(SHIPPED)})


def person_context() -> Context:
    return study().cohort.rows["P01-before"].to_context()


def own() -> dict[str, float]:
    """Return a person at the prior's centre."""
    prior = source().bounds
    return {name: one.centre for name, one in zip(prior.names, prior.parameters, strict=True)}


def changed(group: str, visit: str, seed: int = 0, **changes: float) -> dict[str, float]:
    """Return the parameters of a visit of the person at the centre, over the person's."""
    phi = phi_at_visit(own(), visit, group, source(**changes), np.random.default_rng(seed))
    return {name: value / own()[name] for name, value in phi.items()}


@pytest.mark.slow(minutes=0.2)
def test_the_shipped_files_are_regenerated_byte_for_byte(tmp_path: Path) -> None:
    MAKE.write_trial(tmp_path, source())
    check_made_again("virtual_trial", tmp_path)
    assert examine_cohort(SHIPPED, shipped().recording, 100).problems == ()


def test_a_person_is_drawn_whatever_the_others_and_is_the_shipped_one() -> None:
    person = draw_person(23, table("truth.csv")["group"].iloc[-1], source())
    assert person.name == "P24"
    for visit in person.visits:
        kept = read_samples(SHIPPED / "swe" / f"{visit.context.subject}.csv", 20, 1000.0)
        np.testing.assert_array_equal(visit.samples.speed_m_s, kept.speed_m_s)


def test_it_is_two_groups_of_persons_with_two_visits_each_whom_the_population_s_network_answers() -> None:
    persons = study().cohort.persons
    assert [person.name for person in persons] == [f"P{number:02d}" for number in range(1, 25)]
    assert {person.visits for person in persons} == {(BEFORE, AFTER)}
    assert [sum(person.group == group for person in persons) for group in GROUPS] == [12, 12]
    assert study().refused("amortised") == {}
    assert sum(path.stat().st_size for path in SHIPPED.rglob("*") if path.is_file()) < MOST_BYTES


def test_a_person_keeps_the_physiology_and_the_body_but_for_what_is_of_the_day() -> None:
    truth, subjects = table("truth.csv"), table("subjects.csv")
    of_day = {PEAK_ACTIVE.name, "ejection_fraction", "passive_stiffness_kpa", SPEED_SCALE}
    of_day |= {*THETA_NAMES, *LOADING}
    first, second = (truth[truth["visit"] == visit].reset_index(drop=True) for visit in (BEFORE, AFTER))
    kept = [name for name in source().bounds.names if name not in of_day]
    assert len(kept) == 12
    pd.testing.assert_frame_equal(first[kept], second[kept])
    assert (first[sorted(of_day)] != second[sorted(of_day)]).all(axis=None)
    first, second = (subjects[subjects["visit"] == visit].reset_index(drop=True) for visit in (BEFORE, AFTER))
    kept = ["sex", "bsa_m2", "lvedv_ml", "ivsd_cm", "person", "group"]
    pd.testing.assert_frame_equal(first[kept], second[kept])
    np.testing.assert_allclose(second["age_years"] - first["age_years"], 0.2)


def test_the_drug_acts_on_the_treated_at_the_second_visit_alone() -> None:
    effect = changed("treated", AFTER, **STILL)
    for name, factor in effect.items():
        if name != SPEED_SCALE:
            np.testing.assert_allclose(factor, TRIAL.effect.get(name, 1.0))
    for group, visit in (("control", BEFORE), ("control", AFTER), ("treated", BEFORE)):
        still = changed(group, visit, **STILL)
        assert {value for name, value in still.items() if name != SPEED_SCALE} == {1.0}


def test_visits_differ_by_the_stated_spreads_and_by_nothing_else() -> None:
    drawn = pd.DataFrame([np.log(pd.Series(changed("control", BEFORE, seed))) for seed in range(1500)])
    spread = dict.fromkeys(THETA_NAMES, TRIAL.theta_spread) | dict.fromkeys(LOADING, TRIAL.loading_spread)
    spread |= {"passive_stiffness_kpa": TRIAL.passive_spread, SPEED_SCALE: np.sqrt(0.5) * 0.05}
    for name in drawn:
        np.testing.assert_allclose(drawn[name].std(), spread.get(str(name), 0.0), rtol=0.07, atol=1e-12)
    moving = drawn[list(spread)]
    error = moving.std() / np.sqrt(len(moving))
    assert (moving.mean().abs() < 4.0 * error).all()
    assert np.abs(moving.corr().to_numpy() - np.eye(len(spread))).max() < 0.1


@pytest.mark.parametrize("kept", [0.0, 0.3, 1.0])
def test_the_scale_of_speeds_has_the_prior_s_spread_of_which_a_person_keeps_a_share(kept: float) -> None:
    rng, log_sd = np.random.default_rng(3), 0.05
    persons = np.exp(log_sd * rng.standard_normal(3000))
    pairs = np.log(
        [[scale_of_day(one, source(kept_scale_share=kept), rng) for _ in range(2)] for one in persons]
    )
    np.testing.assert_allclose(pairs.std(axis=0), log_sd, rtol=0.05)
    np.testing.assert_allclose(np.corrcoef(pairs.T)[0, 1], kept, atol=0.06)


def test_what_lies_beyond_the_prior_or_what_is_declared_is_drawn_again() -> None:
    rng, fast = np.random.default_rng(0), replace(person_context(), hr_bpm=131.0)
    with pytest.raises(DrawnAgain, match="bounds"):
        phi_at_visit(own() | {"k0_kpa": 199.0}, AFTER, "treated", source(**STILL), rng)
    with pytest.raises(DrawnAgain, match="heart rate"):
        at_visit(fast, BEFORE, source(**STILL), rng)


def test_nobody_takes_part_whose_heart_is_not_that_of_the_healthy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawing, "MAX_ATTEMPTS", 2)
    strict = MAKE.source_of(shipped(), TRIAL.model_copy(update={"ejection_fraction": (0.98, 0.99)}))
    with pytest.raises(RuntimeError, match="P01: nobody took part in 2 draws: .*ejection fraction"):
        draw_person(0, "control", strict)


def test_the_scale_of_speeds_enters_the_curve_as_its_square() -> None:
    once, scaled = (
        true_curve(person_context(), own() | {SPEED_SCALE: scale}, source().model)[1] for scale in (1.0, 1.1)
    )
    np.testing.assert_allclose(scaled.stiffness_kpa, 1.21 * once.stiffness_kpa)


def test_a_prior_without_what_the_trial_varies_is_named() -> None:
    config = shipped()
    prior = config.priors["calibrated"]
    fixed = prior.model_copy(update={"nuisances": prior.nuisances.model_copy(update={SPEED_SCALE: None})})
    without = config.model_copy(update={"priors": config.priors | {"calibrated": fixed}})
    with pytest.raises(ValueError, match="priors.calibrated.nuisances has no speed_scale"):
        MAKE.source_of(without, TRIAL)
