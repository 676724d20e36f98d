"""Hearts of other generators: their ranges, their streams, what each generator changes and what it leaves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from validation_case import CONFIG, LVESV_FRACTION, SEED, STREAM, generators, recorded

from studies.validation.hearts import hearts, ranges
from studies.validation.hearts.generators import all_generators, generator_of
from studies.validation.hearts.heart import OtherHeart
from studies.validation.hearts.recording import VALIDATION_STREAM, subject_name
from swesbi.measurement.derived import LATE_DIASTOLE
from swesbi.measurement.operator import SERIES_MODULUS_KPA
from swesbi.population.contexts import is_plausible
from swesbi.recording.acquisition import TruthCurve
from swesbi.seeds import generator
from swesbi.virtual.generated import PHYSIOLOGY, draw_context, draw_volunteer
from swesbi.virtual.volunteers import Volunteer, simulate_truth

SIMULATED = ("a", "b", "c", "d", "g", "h")


def volunteer() -> Volunteer:
    """One of the study's generated subjects."""
    rng = generator(SEED, "exam hearts")
    return draw_volunteer(0, CONFIG.priors["calibrated"], CONFIG.acquisition, rng)


def heart(letter: str, index: int) -> OtherHeart:
    """A heart without its recording."""
    return generators()[letter].draw(index, generator(SEED, STREAM, letter, index))


@pytest.mark.parametrize("name", PHYSIOLOGY)
def test_a_doubled_range_has_the_same_middle_and_twice_the_width_in_log(name: str) -> None:
    own, doubled = np.log(PHYSIOLOGY[name]), np.log(ranges.DOUBLED[name])
    assert doubled.mean() == pytest.approx(own.mean())
    assert np.diff(doubled) == pytest.approx(2.0 * np.diff(own))


@pytest.mark.parametrize("letter", SIMULATED)
def test_every_heart_is_recorded_the_same_again_and_others_otherwise(letter: str) -> None:
    one = recorded(letter, 1)
    recorded.cache_clear()
    again, other, elsewhere = recorded(letter, 1), recorded(letter, 2), recorded(letter, 1, "elsewhere")
    assert one.heart.context == again.heart.context
    np.testing.assert_array_equal(one.samples.speed_m_s, again.samples.speed_m_s)
    np.testing.assert_array_equal(one.heart.curve.stiffness_kpa, again.heart.curve.stiffness_kpa)
    for different in (other, elsewhere):
        assert different.heart.peak_active_kpa != one.heart.peak_active_kpa
        assert different.heart.context.hr_bpm != one.heart.context.hr_bpm


def test_all_that_is_drawn_of_a_heart_comes_from_the_stream_of_its_letter_and_number() -> None:
    rng = generator(SEED, STREAM, "a", 4)
    context = draw_context(4, rng)
    made = recorded("a", 4)
    assert replace(made.heart.context, subject=context.subject, lvesv_ml=context.lvesv_ml) == context
    assert made.redrawn == 0
    assert made.heart.context.subject == f"{STREAM}-a005"


def test_hearts_of_the_validation_are_called_by_letter_and_number() -> None:
    assert subject_name("b", 199, VALIDATION_STREAM) == "b200"


def test_the_study_s_generator_makes_the_study_s_subjects() -> None:
    truth = simulate_truth(volunteer())
    made = hearts.heart_of(volunteer(), hearts.Structure({}))
    np.testing.assert_array_equal(made.curve.stiffness_kpa, truth.curve.stiffness_kpa)
    assert made.peak_active_kpa == truth.active_kpa.max()
    assert made.theta is not None
    assert tuple(made.theta) == volunteer().theta


@pytest.mark.parametrize("letter", SIMULATED)
def test_late_diastole_is_as_stiff_as_designed(letter: str) -> None:
    low, high = (ranges.DOUBLED if letter == "b" else PHYSIOLOGY)["late_diastolic_kpa"]
    for index in range(3):
        curve = heart(letter, index).curve
        window = (curve.cycle_phase >= LATE_DIASTOLE[0]) & (curve.cycle_phase <= LATE_DIASTOLE[1])
        assert low <= curve.stiffness_kpa[window].mean() <= high


def test_half_of_the_wider_hearts_are_thick_or_dilated_and_all_are_plausible() -> None:
    population = CONFIG.population_experiments["amortised"].population
    drawn, before = (
        [draw(index, generator(SEED, "contexts", index)) for index in range(400)]
        for draw in (ranges.with_extremes(population), ranges.from_population(population))
    )
    assert all(map(is_plausible, drawn))
    for name, thick_or_dilated in {"ivsd_cm": (1.1, 2.0), "lvedv_ml": (150.0, 300.0)}.items():
        low, high = thick_or_dilated
        values, plain = (np.array([getattr(one, name) for one in made]) for made in (drawn, before))
        among = (values > low) & (values <= high)
        assert values[among].max() > 0.93 * high
        assert (values <= max(high, plain.max())).all()
        # a quarter is made so; of the others as many as in the population, where some are so already
        assert among.mean() == pytest.approx(0.25 + 0.75 * (plain > low).mean(), abs=0.08)


def test_other_mechanics_span_a_factor_of_ten_about_evenly_in_log() -> None:
    drawn = [ranges.other_mechanics(np.random.default_rng(seed)) for seed in range(200)]
    assert {one["length_dependence"] for one in drawn} == {1.0}
    factors = np.array([float(str(one["wall_viscosity_pa_s"])) / 70.0 for one in drawn])
    assert 0.3 <= factors.min() < 0.33
    assert 2.7 < factors.max() <= 3.0
    assert abs(np.log(factors).mean() - np.log(0.3 * 3.0) / 2.0) < 0.15


def test_length_dependence_lowers_attained_stiffness_and_leaves_k_sr_alone_as_a_truth() -> None:
    plain = hearts.heart_of(volunteer(), hearts.Structure({}))
    rng = np.random.default_rng(1)
    dependent = hearts.heart_of(volunteer(), hearts.with_length_dependence(volunteer(), rng))
    assert dependent.theta is None
    assert dependent.k_sr_per_s == plain.k_sr_per_s
    assert dependent.peak_active_kpa < 0.95 * plain.peak_active_kpa


def test_a_spring_in_series_shows_less_than_the_bonds_have() -> None:
    rng = np.random.default_rng(1)
    plain = hearts.heart_of(volunteer(), hearts.Structure({}))
    sprung = hearts.heart_of(volunteer(), hearts.with_series_spring(volunteer(), rng))
    truth = simulate_truth(volunteer())
    assert plain.peak_active_kpa == truth.active_kpa.max()
    assert sprung.isometric_kpa == plain.isometric_kpa
    shown = truth.active_kpa * SERIES_MODULUS_KPA / (truth.active_kpa + SERIES_MODULUS_KPA)
    assert sprung.peak_active_kpa == pytest.approx(shown.max(), rel=1e-12)
    passive = sprung.curve.stiffness_kpa - shown
    np.testing.assert_allclose(passive / truth.passive_kpa, passive[0] / truth.passive_kpa[0], rtol=1e-10)
    assert sprung.curve.stiffness_kpa.max() < plain.curve.stiffness_kpa.max()


def test_louder_recordings_have_twice_the_errors_of_repeats_and_twice_the_assumed_scale() -> None:
    own, loud = CONFIG.acquisition, generators()["g"].acquisition
    assert loud.repeat_sd_fraction == 2.0 * own.repeat_sd_fraction
    assert loud.sweep_fraction == 2.0 * own.sweep_fraction
    speed_scale = CONFIG.priors["calibrated"].nuisances.speed_scale
    assert speed_scale is not None
    assert loud.scale_fraction == 2.0 * speed_scale.log_sd
    assert loud.sample_sd_fraction == own.sample_sd_fraction
    assert generators()["a"].acquisition == own


def test_without_a_prior_of_the_scale_nothing_is_twice_what_is_assumed_of_it() -> None:
    own = CONFIG.priors["calibrated"]
    fixed = own.model_copy(update={"nuisances": own.nuisances.model_copy(update={"speed_scale": None})})
    population = CONFIG.population_experiments["amortised"].population
    made = all_generators(population, fixed, CONFIG.acquisition, LVESV_FRACTION)
    assert set(generators()) - set(made) == {"g"}
    with pytest.raises(ValueError, match=r"no generator 'g'.* where the prior .* `nuisances.speed_scale`"):
        generator_of(made, "g")


@pytest.mark.parametrize("letter", SIMULATED)
def test_the_listed_lvesv_is_the_heart_s_own_within_the_error_of_its_measurement(letter: str) -> None:
    for index in range(3):
        made = heart(letter, index)
        true_ml = made.context.lvedv_ml * made.volume_ratio
        assert 0.0 < abs(np.log(made.context.lvesv_ml / true_ml)) < 4.0 * LVESV_FRACTION
        assert is_plausible(made.context)


def test_the_volume_ratio_is_that_of_the_true_beat() -> None:
    volume = simulate_truth(volunteer()).beats.volume_ml[0]
    made = hearts.heart_of(volunteer(), hearts.Structure({}))
    assert made.volume_ratio == volume.min() / volume.max()


def test_other_passive_stiffness_leaves_the_beat_of_an_exponential_wall_alone() -> None:
    structures = [hearts.with_wall_tangent(volunteer(), np.random.default_rng(seed)) for seed in range(60)]
    exponential = [one for one in structures if not one.forward_model]
    assert 15 < len(exponential) < 45
    made = hearts.heart_of(volunteer(), exponential[0])
    plain = hearts.heart_of(volunteer(), hearts.Structure({}))
    assert made.peak_active_kpa == plain.peak_active_kpa
    difference = made.curve.stiffness_kpa - plain.curve.stiffness_kpa
    assert np.ptp(difference) > 0.5


def test_an_unknown_letter_is_named_with_those_that_there_are() -> None:
    with pytest.raises(ValueError, match="no generator 'q'; those of other hearts: a, b, c"):
        generator_of(generators(), "q")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"active_kpa": np.full(100, np.nan)}, "must be a positive stiffness"),
        ({"volume_ratio": 1.2}, "must lie between 0 and 1"),
        ({"k_sr_per_s": 12.0}, "is not that of theta"),
        ({"theta": np.ones(4)}, r"theta has shape \(4,\)"),
        ({"curve": TruthCurve(np.array([0.0, 0.5]), np.array([1.0, -1.0]))}, "not positive throughout"),
    ],
)
def test_a_heart_whose_truths_contradict_each_other_is_refused(
    changes: dict[str, object], words: str
) -> None:
    made = hearts.heart_of(volunteer(), hearts.Structure({}))
    with pytest.raises(ValueError, match=words):
        replace(made, **changes)
