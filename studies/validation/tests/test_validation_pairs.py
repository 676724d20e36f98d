"""Persons who are recorded twice: what stays to the bit, what changes and by how much, and their streams."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import sqrt

import numpy as np
import pytest
from other_hearts_case import CONFIG, SEED, generators
from scipy.special import ndtri
from scipy.stats import kstest

from studies.validation.pairs import (
    CAPACITANCE,
    REACH,
    RESISTANCE,
    VARIANTS,
    PairSource,
    RecordedVisit,
    Spreads,
    VisitTruth,
    beats_of,
    first_visit,
    later_truth,
    physiology_anew,
    second_visit,
    shared_truth,
    shown_curve,
)
from swesbi.measurement.operator import passive_shape
from swesbi.measurement.speeds import MeasuredBy
from swesbi.virtual.hearts.hearts import SimulatedHearts
from swesbi.virtual.hearts.ranges import DOUBLED
from swesbi.virtual.volunteers import OWN_PARAMETERS

SPREADS = Spreads(heart_rate=0.06, loading=0.08, stressed_volume=0.05)
OF_THE_DAY = (RESISTANCE, CAPACITANCE)
SHARED = "activation_ramp_s"  # by all hearts of this kind
KEPT = [name for name in OWN_PARAMETERS if name not in (*OF_THE_DAY, SHARED)]


@cache
def source() -> PairSource:
    hearts = generators()["b"]
    assert isinstance(hearts, SimulatedHearts)
    population = CONFIG.population_experiments["amortised"].population
    return PairSource(
        hearts, SPREADS, population, CONFIG.recording, CONFIG.measurement.grid_points, SEED, "tests of pairs"
    )


@cache
def first() -> RecordedVisit:
    return first_visit(source(), 0)


@cache
def resting() -> VisitTruth:
    """The first person with a theta and a heart rate from which no change leads out of bounds."""
    own = first().truth.volunteer
    context = replace(own.context, hr_bpm=70.0)
    return replace(first().truth, volunteer=replace(own, context=context, theta=(45.0, 6.0, 30.0)))


def later(name: str, number: int = 0, draw: int = 0) -> VisitTruth:
    return later_truth(resting(), VARIANTS[name], number, source(), np.random.default_rng(draw))


def factors(name: str, number: int = 0, draw: int = 0) -> np.ndarray:
    return np.array(later(name, number, draw).volunteer.theta) / np.array(resting().volunteer.theta)


def kept(visit: VisitTruth) -> dict[str, float]:
    own = {name: getattr(visit.volunteer, name) for name in KEPT}
    return own | {"a": visit.passive_scale_kpa, "q": visit.speed_scale}


@pytest.mark.parametrize("name", ["changed", "unchanged", "power"])
def test_what_a_person_keeps_is_the_same_to_the_bit_and_the_day_is_not(name: str) -> None:
    visit = later(name)
    assert kept(visit) == kept(resting())
    assert visit.stressed_volume_factor != 1.0
    assert visit.volunteer.context.hr_bpm != resting().volunteer.context.hr_bpm
    for loading in OF_THE_DAY:
        assert getattr(visit.volunteer, loading) != getattr(resting().volunteer, loading)


def test_theta_changes_as_the_variant_says() -> None:
    assert (factors("unchanged") == 1.0).all()
    assert factors("power") == pytest.approx([1.0, 1.0, 0.75], abs=1e-12)
    rng = np.random.default_rng(11)
    drawn = np.log([VARIANTS["changed"].theta_factors(0, rng) for _ in range(500)]) / np.log(REACH)
    assert kstest(drawn.ravel(), "uniform", (-1.0, 2.0)).pvalue > 0.01


@pytest.mark.parametrize("name", ["half_redrawn", "drug_on_alpha"])
def test_every_other_pair_of_a_disturbed_variant_keeps_its_theta(name: str) -> None:
    for number in range(4):
        same = (factors(name, number) == 1.0).all()
        assert same == VARIANTS[name].keeps_theta(number) == (number % 2 == 0)


def test_the_drug_moves_alpha_and_nothing_else_of_the_person() -> None:
    moved, own = kept(later("drug_on_alpha")), kept(resting())
    assert moved.pop("destruction_alpha") == pytest.approx(1.2 * own.pop("destruction_alpha"))
    assert moved == own


def test_visits_differ_by_the_root_of_two_times_what_each_lies_about_the_persons_own() -> None:
    visits = [later("unchanged", draw=draw) for draw in range(600)]
    own = resting().volunteer
    of_day = [getattr(visit.volunteer, RESISTANCE) / getattr(own, RESISTANCE) for visit in visits]
    spread = {
        "hr": np.std([np.log(visit.volunteer.context.hr_bpm / own.context.hr_bpm) for visit in visits]),
        "volume": np.std([np.log(visit.stressed_volume_factor) for visit in visits]),
        "loading": np.std(np.log(of_day)),
    }
    wanted = {"hr": SPREADS.heart_rate, "volume": SPREADS.stressed_volume, "loading": SPREADS.loading}
    for name, sd in wanted.items():
        assert spread[name] == pytest.approx(sqrt(2.0) * sd, rel=0.12), name


def test_half_of_the_variance_of_scores_is_drawn_anew_and_ranges_stay() -> None:
    rng, own = np.random.default_rng(5), first().truth.volunteer
    low, high = DOUBLED["wall_stiffness"]
    before, after = rng.uniform(low, high, 4000), np.empty(4000)
    for number, value in enumerate(before):
        person = replace(own, wall_stiffness=float(value))
        after[number] = physiology_anew(person, DOUBLED, 0.5, rng)["wall_stiffness"]
    scores = ndtri((np.array([before, after]) - low) / (high - low))
    assert np.corrcoef(scores)[0, 1] == pytest.approx(0.5, abs=0.04)
    assert kstest(after, "uniform", (low, high - low)).pvalue > 0.01


def test_the_scale_of_the_speeds_keeps_half_of_its_variance_where_it_is_redrawn() -> None:
    own, sd = resting().speed_scale, source().hearts.acquisition.scale_fraction
    logs = np.log([later("half_redrawn", draw=draw).speed_scale for draw in range(1500)])
    assert logs.mean() == pytest.approx(0.5 * np.log(own), abs=0.15 * sd)
    assert logs.std() == pytest.approx(sqrt(0.75) * sd, rel=0.08)


def test_speeds_show_their_scale_and_the_loading_of_the_day() -> None:
    truth = first().truth
    beats = beats_of(truth.volunteer, 1.0)
    plain = shown_curve(replace(truth, speed_scale=1.0), beats).stiffness_kpa
    assert shown_curve(replace(truth, speed_scale=1.1), beats).stiffness_kpa == pytest.approx(1.21 * plain)
    fuller = beats_of(truth.volunteer, 1.1)
    assert fuller.end_diastolic_volume_ml[0] > beats.end_diastolic_volume_ml[0]


def test_a_stranger_has_a_heart_of_its_own_in_the_context_of_the_first() -> None:
    stranger = second_visit(source(), 0, "strangers", first())
    assert stranger.truth.volunteer.context == first().truth.volunteer.context
    assert not set(kept(stranger.truth).values()) & set(kept(first().truth).values())
    assert not set(stranger.truth.volunteer.theta) & set(first().truth.volunteer.theta)


def test_visits_depend_on_seed_stream_number_and_variant_alone() -> None:
    again = second_visit(source(), 0, "unchanged", first())
    once = second_visit(source(), 0, "unchanged", first())
    assert again.samples.speed_m_s.tobytes() == once.samples.speed_m_s.tobytes()
    assert again.observation.subject == "tests-of-pairs-001-unchanged"
    other = first_visit(replace(source(), stream="other tests of pairs"), 0)
    assert other.truth.volunteer.theta != first().truth.volunteer.theta


def test_true_shared_parameters_are_those_of_the_inference_model() -> None:
    model = CONFIG.forward_model
    shared = shared_truth(first().truth, model)
    assert list(shared) == [name for name in CONFIG.changes.shares.by_name if name != "discrepancy"]
    assert shared["passive_wall_factor"] == pytest.approx(
        444.0 * first().truth.volunteer.wall_stiffness / model.passive_c0_pa
    )
    assert shared["speed_scale"] == first().truth.speed_scale
    assert shared["length_dependence"] == 0.0


def test_the_true_passive_stiffness_is_told_by_its_ends_and_between() -> None:
    """With what is told of it, the inference model's passive law goes through it at both ends and between."""
    truth = first().truth
    shared = shared_truth(truth, CONFIG.forward_model)
    stretch = beats_of(truth.volunteer, truth.stressed_volume_factor).stretch[0]
    at = np.array([stretch.max(), 0.5 * (stretch.max() + stretch.min()), stretch.min()])
    true = truth.passive_scale_kpa * passive_shape(at, truth.volunteer.passive_exponent_b)
    law = MeasuredBy(true[:1], shared["passive_ratio"], shared["passive_middle_factor"])
    np.testing.assert_allclose(law.passive_kpa(np.array([[0.0, 0.5, 1.0]]))[0], true)
