"""The stored hearts of letters e and f: whole, drawn from their streams, and as hearts of a generator."""

import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import speed_case

from data.other_hearts.drawn import Drawn, People, draw_heart
from data.other_hearts.land_population import EJECTION_FRACTION, SYSTOLIC_MMHG, LandHearts
from data.other_hearts.make import COUNTS, all_hearts
from data.other_hearts.physioblocks import PhysioBlocksHearts, Program, parameters_of
from studies.validation.hearts.beat import Beat
from studies.validation.hearts.generators import STORED, all_generators
from studies.validation.hearts.heart import K_SR
from studies.validation.hearts.stored import (
    FILES,
    HeartsOfLetter,
    StoredHeart,
    StoredHearts,
    Stream,
    stored_generators,
)
from swesbi.artefacts import ArtefactError, Provenance
from swesbi.context import Context
from swesbi.heart.settings import ForwardModelSettings
from swesbi.measurement.derived import LATE_DIASTOLE
from swesbi.measurement.operator import passive_shape
from swesbi.parameters import THETA_NAMES
from swesbi.population.contexts import is_plausible
from swesbi.population.settings import PopulationSettings
from swesbi.prior import PriorSettings, in_bounds
from swesbi.recording.settings import ACQUISITION
from swesbi.seeds import generator, seed_sequence

FOLDER = Path(__file__).parents[1]
LETTERS = ("e", "f")
"""Those in the repository; hearts of (p) are made when they are asked for."""
LARGEST_FILE = 1_000_000
CONFIG = speed_case.shipped()
LVESV_FRACTION = speed_case.rule().volumes.lvesv_tolerance_fraction


@cache
def stored(letter: str) -> tuple[tuple[StoredHeart, ...], Provenance]:
    kept = HeartsOfLetter.read(FOLDER / FILES[letter][0])
    return tuple(kept.hearts), kept.made


def prior_of_theta() -> PriorSettings:
    """Return the prior that the hearts of PhysioBlocks have theta of; its nuisances were others then."""
    prior = stored("e")[1].settings["prior"]
    return PriorSettings.from_plain({name: prior[name] for name in THETA_NAMES})


def forward_model_of_land() -> ForwardModelSettings:
    """Return the settings that the hearts of Land were made with; no length dependence was a word then."""
    plain = stored("f")[1].settings["forward_model"]
    assert plain["length_dependence"] == "none"
    return ForwardModelSettings.from_plain({**plain, "length_dependence": 0.0})


def people_of(letter: str) -> People:
    settings = stored(letter)[1].settings
    return People(PopulationSettings.from_plain(settings["population"]), settings["lvesv_fraction"])


@pytest.mark.parametrize("letter", LETTERS)
def test_hearts_are_of_the_people_of_the_configuration(letter: str) -> None:
    """A heart of a former population, or measured otherwise, is drawn anew: data/other_hearts/README.md."""
    population = CONFIG.population_experiments["amortised"].population
    assert people_of(letter) == People(population, LVESV_FRACTION)
    assert stored(letter)[1].seed == CONFIG.seed


@pytest.mark.parametrize("letter", LETTERS)
def test_the_listed_lvesv_is_the_heart_s_own_within_the_error_of_its_measurement(letter: str) -> None:
    hearts = stored(letter)[0]
    errors = [
        np.log(heart.context.lvesv_ml / (heart.context.lvedv_ml * heart.beat.volume_ratio))
        for heart in hearts
    ]
    assert 0.7 * LVESV_FRACTION < np.std(errors) < 1.3 * LVESV_FRACTION
    assert abs(np.mean(errors)) < 4.0 * LVESV_FRACTION / np.sqrt(len(hearts))
    assert all(is_plausible(heart.context) for heart in hearts)
    assert all(heart.other_heart().volume_ratio == heart.beat.volume_ratio for heart in hearts)


def test_the_page_says_of_the_hearts_what_the_command_prints() -> None:
    command = [sys.executable, str(FOLDER / "describe.py")]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    page = " ".join((FOLDER / "README.md").read_text(encoding="utf-8").split())
    assert len(printed) == 19
    assert [line for line in printed if line not in page] == []


@pytest.mark.parametrize("letter", LETTERS)
def test_hearts_are_all_there(letter: str) -> None:
    numbers = [(heart.stream, heart.number) for heart in stored(letter)[0]]
    counts = COUNTS[letter].items()
    assert numbers == [(stream, number) for stream, count in counts for number in range(count)]
    assert (FOLDER / FILES[letter][0]).stat().st_size < LARGEST_FILE


def test_hearts_that_are_there_are_kept_and_the_others_drawn() -> None:
    hearts, provenance = stored("f")
    source = LandHearts(forward_model_of_land())
    again = all_hearts(source, people_of("f"), provenance.seed, [*hearts[:3], *hearts[4:]])
    assert [new is there for new, there in zip(again, hearts, strict=True)].index(False) == 3
    assert_same_person(again[3].context, hearts[3].context)


@pytest.mark.parametrize("letter", LETTERS)
def test_a_stored_heart_is_as_stiff_as_it_is_designed(letter: str) -> None:
    for heart in stored(letter)[0]:
        sits, beat = heart.other_heart(), heart.beat
        late = (beat.phase >= LATE_DIASTOLE[0]) & (beat.phase <= LATE_DIASTOLE[1])
        assert sits.curve.stiffness_kpa[late].mean() == pytest.approx(heart.late_diastolic_kpa, rel=1e-6)
        np.testing.assert_array_equal(sits.active_kpa, beat.active_kpa)
        assert sits.peak_active_kpa == beat.active_kpa.max()
        assert sits.curve.stiffness_kpa - beat.active_kpa == pytest.approx(
            heart.passive_scale_kpa * passive_shape(beat.stretch, heart.passive_exponent_b)
        )


def test_hearts_of_physioblocks_have_theta_of_the_prior() -> None:
    hearts, _ = stored("e")
    theta = np.stack([heart.theta for heart in hearts])
    assert in_bounds(theta, prior_of_theta()).all()
    assert all(heart.other_heart().k_sr_per_s == heart.theta[K_SR] for heart in hearts)
    assert all(heart.beat.active_kpa.max() < heart.theta[0] for heart in hearts)


def test_hearts_of_land_have_another_law_and_beats_of_people() -> None:
    for heart in stored("f")[0]:
        assert heart.other_heart().theta is None
        assert heart.other_heart().k_sr_per_s is None
        assert EJECTION_FRACTION[0] <= heart.beat.ejection_fraction <= EJECTION_FRACTION[1]
        assert SYSTOLIC_MMHG[0] <= heart.beat.arterial_mmhg.max() <= SYSTOLIC_MMHG[1]


def assert_same_person(again: Context, there: Context) -> None:
    """All alike, but the LVESV only as far as the beats: of f integrated, of e in single precision."""
    assert replace(again, lvesv_ml=there.lvesv_ml) == there
    assert again.lvesv_ml == pytest.approx(there.lvesv_ml, rel=1e-3)


@pytest.mark.parametrize(("stream", "number"), [("exam", 0), ("development", 2)])
def test_a_heart_of_land_comes_again_from_its_stream(stream: Stream, number: int) -> None:
    hearts, provenance = stored("f")
    source = LandHearts(forward_model_of_land())
    again = draw_heart(source, stream, number, people_of("f"), provenance.seed)
    there = next(heart for heart in hearts if (heart.stream, heart.number) == (stream, number))
    assert_same_person(again.context, there.context)
    assert again.own == pytest.approx(there.own, rel=1e-12)
    assert again.beat.active_kpa == pytest.approx(there.beat.active_kpa, rel=1e-3, abs=0.01)
    assert again.refused_implausible == there.refused_implausible


REPLAY = """
import json, sys
print(json.dumps({"physioblocks": "2.0.1"}), flush=True)
answers = json.load(open(sys.argv[1]))
for line, answer in zip(sys.stdin, answers):
    json.loads(line)["parameters"]["heart_radius"]
    print(json.dumps(answer), flush=True)
"""


def replaying(folder: Path, answers: str) -> Program:
    """Return a program that gives these answers, whatever it is asked."""
    (folder / "program.py").write_text(REPLAY, encoding="utf-8")
    (folder / "answers.json").write_text(answers, encoding="utf-8")
    return Program([sys.executable, str(folder / "program.py"), str(folder / "answers.json")])


def as_answer(beat: Beat) -> str:
    curves = (f'"{name}": {curve.tolist()}' for name, curve in vars(beat).items())
    return "{" + ", ".join(curves) + "}"


def test_a_heart_of_physioblocks_comes_again_from_its_stream(tmp_path: Path) -> None:
    """What is drawn of a heart follows from its stream; the beats are the stored ones."""
    hearts, provenance = stored("e")
    there = next(heart for heart in hearts if heart.refused_failed and not heart.refused_stiff)
    failures = '{"error": "no convergence"}, ' * there.refused_failed
    with replaying(tmp_path, f"[{failures}{as_answer(there.beat)}]") as program:
        source = PhysioBlocksHearts(prior_of_theta(), program)
        again = draw_heart(source, there.stream, there.number, people_of("e"), provenance.seed)
    assert_same_person(again.context, there.context)
    assert again.theta == pytest.approx(there.theta, rel=1e-9)
    assert again.own == pytest.approx(there.own, rel=1e-12)
    assert again.refused_failed == there.refused_failed
    assert again.passive_scale_kpa == pytest.approx(there.passive_scale_kpa, rel=1e-5)


def test_a_program_that_ends_says_so(tmp_path: Path) -> None:
    heart = stored("e")[0][0]
    drawn = Drawn(heart.theta, dict(zip(heart.own_names, heart.own.tolist(), strict=True)))
    with replaying(tmp_path, "[]") as program, pytest.raises(OSError, match="PhysioBlocks ended"):
        program.beat(parameters_of(heart.context, drawn), heart.context.period_s)


def test_a_heart_of_the_reference_size_meets_the_reference_resistance(tmp_path: Path) -> None:
    """With size and rate the resistance changes so that volume over period times it stays."""
    reference = replace(stored("e")[0][0].context, hr_bpm=60.0, lvedv_ml=4.0 / 3.0 * np.pi * 3.4**3)
    smaller = replace(reference, hr_bpm=90.0, lvedv_ml=0.5 * reference.lvedv_ml)
    with replaying(tmp_path, "[]") as program:
        source = PhysioBlocksHearts(prior_of_theta(), program)
        own = [source.draw(context, np.random.default_rng(1)).own for context in (reference, smaller)]
    ratio = {name: own[1][name] / own[0][name] for name in own[0]}
    assert ratio.pop("distal_resistance_pa_s_m3") == pytest.approx(2.0 / 1.5)
    assert ratio.pop("proximal_resistance_pa_s_m3") == pytest.approx(2.0 / 1.5)
    assert set(ratio.values()) == {1.0}
    assert 0.8 * 1.1e8 <= own[0]["distal_resistance_pa_s_m3"] <= 1.25 * 1.1e8


def test_saving_is_exact_to_the_byte(tmp_path: Path) -> None:
    hearts, made = stored("f")
    HeartsOfLetter(hearts, made).write(tmp_path / "again.h5", made)
    HeartsOfLetter(hearts, made).write(tmp_path / "twice.h5", made)
    assert (tmp_path / "again.h5").read_bytes() == (tmp_path / "twice.h5").read_bytes()
    for before, after in zip(hearts, HeartsOfLetter.read(tmp_path / "again.h5").hearts, strict=True):
        assert before.context == after.context
        assert np.array_equal(before.beat.stretch, after.beat.stretch)
        assert np.array_equal(before.own, after.own)


def source_of(letter: str) -> StoredHearts:
    return stored_generators(FOLDER, ACQUISITION)[letter]


@pytest.mark.parametrize("letter", LETTERS)
@pytest.mark.parametrize("stream", COUNTS["f"])
def test_a_generator_knows_its_hearts_by_their_streams(letter: str, stream: Stream) -> None:
    rng, untouched = (generator(stored(letter)[1].seed, stream, letter, 3) for _ in range(2))
    there = next(one for one in stored(letter)[0] if (one.stream, one.number) == (stream, 3))
    heart = source_of(letter).draw(3, rng)
    assert heart.context == there.context
    assert np.array_equal(heart.curve.stiffness_kpa, there.other_heart().curve.stiffness_kpa)
    assert not set(rng.random(100)) & set(untouched.random(100_000))
    assert source_of(letter).draw(3, rng) is heart  # as after a recording that ingestion refused


@pytest.mark.parametrize(
    "rng",
    [
        generator(20260, "exam", "f", 60),
        generator(20260, "exam", "e", 0),
        generator(1, "exam", "f", 0),
        generator(20260, "small_exam", "f", 0),
        np.random.Generator(np.random.MT19937(seed_sequence(20260, "exam", "f", 0))),
    ],
)
def test_a_heart_that_is_not_stored_is_asked_for_in_vain(rng: np.random.Generator) -> None:
    with pytest.raises(ValueError, match="there are 60 of 'exam', 10 of 'development', of seed 20260"):
        source_of("f").draw(0, rng)


def test_hearts_that_are_not_in_the_repository_are_made_by_the_command_that_is_told(tmp_path: Path) -> None:
    source = replace(source_of("e"), letter="p", path=tmp_path / "emulated.h5")
    with pytest.raises(ArtefactError, match=r"no such file; make it: .*make\.py p .*emulated\.h5"):
        source.draw(0, generator(20260, "filling", "p", 0))


def test_a_file_of_another_letter_is_refused() -> None:
    source = replace(source_of("e"), path=FOLDER / FILES["f"][0])
    with pytest.raises(ValueError, match="holds hearts of 'f', not of 'e'"):
        source.draw(0, generator(20260, "exam", "e", 0))


def test_the_stored_letters_are_among_all_generators() -> None:
    people, prior = people_of("e"), prior_of_theta()
    generators = all_generators(people.population, prior, ACQUISITION, people.lvesv_fraction)
    assert {letter: generators[letter].title for letter in FILES} == {
        letter: title for letter, (_, title) in FILES.items()
    }
    assert (speed_case.ROOT / STORED).resolve() == FOLDER.resolve()


def test_a_beat_that_is_no_numbers_is_refused() -> None:
    with pytest.raises(RuntimeError, match="stretch is not finite"):
        replace(stored("f")[0][0].beat, stretch=np.full(200, np.nan))
