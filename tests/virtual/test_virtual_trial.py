"""The shipped virtual trial: what its files say, and that they are drawn as they say."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import matplotlib.image
import numpy as np
import pandas as pd
import pytest
from makers import maker, shipped_files
from speed_case import shipped
from study_copy import ROOT

from swesbi.__main__ import main
from swesbi.config.read import read_merged
from swesbi.config.study import Study, load_study
from swesbi.parameters import PEAK_ACTIVE, THETA_NAMES
from swesbi.prior import JointPriorSettings, in_bounds
from swesbi.recording.cohort.clinical import ClinicalRow
from swesbi.recording.reader import read_samples
from swesbi.virtual.trial import persons as drawing
from swesbi.virtual.trial.persons import (
    DrawnAgain,
    at_visit,
    draw_person,
    phi_at_visit,
    scale_of_day,
    true_curve,
)
from swesbi.virtual.trial.settings import AFTER, BEFORE, GROUPS, LOADING, SPEED_SCALE, TRIAL, TrialSettings
from swesbi.virtual.trial.source import TrialSource, narrowed

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
    made = sorted(path.relative_to(tmp_path) for path in tmp_path.rglob("*") if path.is_file())
    assert shipped_files("virtual_trial") == [path.as_posix() for path in made]
    for path in made:
        if path.suffix == ".png":
            picture, kept = (matplotlib.image.imread(folder / path) for folder in (tmp_path, SHIPPED))
            np.testing.assert_allclose(picture, kept, atol=0.02)
        else:
            assert (tmp_path / path).read_bytes() == (SHIPPED / path).read_bytes(), path


def test_a_person_is_drawn_whatever_the_others_and_is_the_shipped_one(tmp_path: Path) -> None:
    group = table("truth.csv")["group"].iloc[-1]
    person = draw_person(23, group, source())
    assert person.name == "P24"
    for visit in person.visits:
        kept = read_samples(SHIPPED / "swe" / f"{visit.context.subject}.csv", 20, 1000.0)
        np.testing.assert_array_equal(visit.samples.speed_m_s, kept.speed_m_s)
    tables = {"subjects.csv": MAKE.subject_table([person]), "truth.csv": MAKE.truth_table([person])}
    for name, made in tables.items():
        made.to_csv(tmp_path / name, index=False, float_format=MAKE.DIGITS if name == "truth.csv" else None)
        lines = (SHIPPED / name).read_text().splitlines()
        assert (tmp_path / name).read_text().splitlines() == [lines[0], *lines[-2:]]


def test_it_is_two_groups_of_persons_with_two_visits_each() -> None:
    persons = study().cohort.persons
    assert [person.name for person in persons] == [f"P{number:02d}" for number in range(1, 25)]
    assert {person.visits for person in persons} == {(BEFORE, AFTER)}
    assert [sum(person.group == group for person in persons) for group in GROUPS] == [12, 12]
    assert all(person.subjects == (f"{person.name}-{BEFORE}", f"{person.name}-{AFTER}") for person in persons)
    assert sum(path.stat().st_size for path in SHIPPED.rglob("*") if path.is_file()) < MOST_BYTES


def test_everybody_is_answered_by_the_network_of_the_population_and_has_no_clinical_measures() -> None:
    assert study().refused("amortised") == {}
    assert {study().cohort.clinical_of(subject) for subject in study().subjects} == {ClinicalRow()}


def test_the_treated_change_by_the_effect_and_by_what_visits_differ_by() -> None:
    truth = table("truth.csv")
    for name in THETA_NAMES:
        control, treated = (MAKE.log_ratios(truth, name, group) for group in GROUPS)
        error = np.sqrt(2.0) * TRIAL.theta_spread / np.sqrt(TRIAL.persons_per_group)
        assert abs(control.mean()) < 3.5 * error
        assert abs(treated.mean() - np.log(TRIAL.effect.get(name, 1.0))) < 3.5 * error
        spread = np.concatenate([control - control.mean(), treated - treated.mean()]).std()
        np.testing.assert_allclose(spread, np.sqrt(2.0) * TRIAL.theta_spread, rtol=0.5)


def test_a_person_keeps_the_physiology_and_the_body_but_for_what_is_of_the_day() -> None:
    truth, subjects = table("truth.csv"), table("subjects.csv")
    of_day = {
        *THETA_NAMES,
        PEAK_ACTIVE.name,
        "ejection_fraction",
        "passive_stiffness_kpa",
        *LOADING,
        SPEED_SCALE,
    }
    first, second = (truth[truth["visit"] == visit].reset_index(drop=True) for visit in (BEFORE, AFTER))
    kept = [name for name in source().bounds.names if name not in of_day]
    assert len(kept) == 12
    pd.testing.assert_frame_equal(first[kept], second[kept])
    assert (first[sorted(of_day)] != second[sorted(of_day)]).all(axis=None)
    first, second = (subjects[subjects["visit"] == visit].reset_index(drop=True) for visit in (BEFORE, AFTER))
    kept = ["sex", "bsa_m2", "lvedv_ml", "ivsd_cm", "person", "group"]
    pd.testing.assert_frame_equal(first[kept], second[kept])
    np.testing.assert_allclose(second["age_years"] - first["age_years"], 0.2)


def test_the_truth_lies_within_the_prior_and_persons_are_healthy_at_the_first_visit() -> None:
    truth, prior = table("truth.csv"), source().bounds
    assert in_bounds(truth[list(prior.names)].to_numpy(), prior).all()
    low, high = TRIAL.ejection_fraction
    assert truth.loc[truth["visit"] == BEFORE, "ejection_fraction"].between(low, high).all()


@pytest.mark.slow
def test_validate_finds_nothing_wrong(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    assert main(["validate", str(SHIPPED.relative_to(ROOT))]) == 0
    shown = capsys.readouterr().out
    assert (
        "48 recordings can be used; origin: a virtual trial, simulated by swesbi.virtual.trial; not" in shown
    )
    assert "persons: 24, by number of visits: 24 with 2 (before, after)." in shown


def test_the_drug_acts_on_the_treated_at_the_second_visit_alone() -> None:
    effect = changed("treated", AFTER, **STILL)
    for name, factor in effect.items():
        if name != SPEED_SCALE:
            np.testing.assert_allclose(factor, TRIAL.effect.get(name, 1.0))
    for group, visit in (("control", BEFORE), ("control", AFTER), ("treated", BEFORE)):
        still = changed(group, visit, **STILL)
        assert all(still[name] == 1.0 for name in still if name != SPEED_SCALE)


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


def test_persons_are_of_one_group_of_the_population_and_narrower_than_the_prior() -> None:
    own_source = source()
    assert list(own_source.population.groups) == ["adults"]
    assert own_source.population.groups["adults"].share == 1.0
    wide, narrow = own_source.bounds, own_source.model.prior
    for name, before, after in zip(wide.names, wide.parameters, narrow.parameters, strict=True):
        share = 0.5 if name in (*THETA_NAMES, "passive_stiffness_kpa") else 1.0
        assert after == before.model_copy(update={"log_sd": share * before.log_sd})
    assert isinstance(narrowed(wide, 1.0), JointPriorSettings) and narrowed(wide, 1.0) == wide


def test_a_parameter_beyond_the_prior_s_bounds_is_drawn_again() -> None:
    far = own() | {"k0_kpa": 199.0}
    with pytest.raises(DrawnAgain, match="bounds"):
        phi_at_visit(far, AFTER, "treated", source(**STILL), np.random.default_rng(0))


def test_a_heart_rate_beyond_what_is_declared_is_drawn_again() -> None:
    context = study().cohort.rows["P01-before"].to_context()
    fast = context.__class__(**(vars(context) | {"hr_bpm": 131.0}))
    with pytest.raises(DrawnAgain, match="heart rate"):
        at_visit(fast, BEFORE, source(**STILL), np.random.default_rng(0))


def test_nobody_takes_part_whose_heart_is_not_that_of_the_healthy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawing, "MAX_ATTEMPTS", 2)
    strict = MAKE.source_of(shipped(), TRIAL.model_copy(update={"ejection_fraction": (0.98, 0.99)}))
    with pytest.raises(RuntimeError, match="P01: nobody took part in 2 draws: .*ejection fraction"):
        draw_person(0, "control", strict)


def test_the_scale_of_speeds_enters_the_curve_as_its_square() -> None:
    context = study().cohort.rows["P01-before"].to_context()
    _, once = true_curve(context, own(), source().model)
    _, scaled = true_curve(context, own() | {SPEED_SCALE: 1.1}, source().model)
    np.testing.assert_allclose(scaled.stiffness_kpa, 1.21 * once.stiffness_kpa)


def test_what_the_configuration_lacks_is_named() -> None:
    with pytest.raises(ValueError, match="no group 'giants'; it has "):
        MAKE.source_of(shipped(), TRIAL.model_copy(update={"population_group": "giants"}))
    config = shipped()
    prior = config.priors["calibrated"]
    fixed = prior.model_copy(update={"nuisances": prior.nuisances.model_copy(update={SPEED_SCALE: None})})
    without = config.model_copy(update={"priors": config.priors | {"calibrated": fixed}})
    with pytest.raises(ValueError, match="priors.calibrated.nuisances has no speed_scale"):
        MAKE.source_of(without, TRIAL)


def test_the_design_is_checked() -> None:
    with pytest.raises(ValueError, match="kept_scale_share"):
        TrialSettings.from_plain(TRIAL.to_plain() | {"kept_scale_share": 1.5})
