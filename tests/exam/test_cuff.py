"""Cuff pressures of hearts of the exam: true pressures, errors, a stream of their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from exam_case import CONFIG, HEART, SEED, STREAM, generators, recorded
from study_copy import ROOT

from swesbi.exam import hearts
from swesbi.exam.beat import Beat
from swesbi.exam.cuff import cuff_pressures
from swesbi.exam.generators import STORED
from swesbi.exam.stored import FILES, load_hearts, proximal_share
from swesbi.heart.aorta import aortic_pressure_mmhg
from swesbi.heart.simulate import simulate
from swesbi.recording.ingest import ingest
from swesbi.seeds import generator
from swesbi.virtual_cohort.acquisition import acquire
from swesbi.virtual_cohort.generated import draw_volunteer
from swesbi.virtual_cohort.volunteers import forward_model_of

ERRORS = CONFIG.clinical.errors
FOLDER = ROOT / STORED


def test_a_simulated_heart_has_the_pressures_at_the_root_of_its_aorta() -> None:
    rng = generator(SEED, "exam hearts")
    own = draw_volunteer(0, CONFIG.priors["calibrated"], CONFIG.acquisition, rng)
    made = hearts.heart_of(own, hearts.Structure({}))
    settings = forward_model_of(own)
    aortic = aortic_pressure_mmhg(simulate(np.array([own.theta]), own.context, settings), settings)[0]
    assert (made.systolic_mmhg, made.diastolic_mmhg) == (aortic.max(), aortic.min())
    assert 80.0 < made.systolic_mmhg < 180.0


@pytest.mark.parametrize("letter", ["a", "f"])
def test_recordings_do_not_know_of_the_cuff(letter: str) -> None:
    """The same heart and recording come from the stream alone, as they did before there was a cuff."""
    made = recorded(letter, 3, "development", 20260)
    source, rng = generators()[letter], generator(20260, "development", letter, 3)
    drawn = source.draw(3, rng)
    heart = replace(drawn, context=made.heart.context)
    samples = acquire(heart.curve, heart.context, source.acquisition, rng)
    assert made.redrawn == 0
    np.testing.assert_array_equal(samples.speed_m_s, made.samples.speed_m_s)
    plain = ingest(samples, heart.context, CONFIG.recording, CONFIG.measurement.grid_points)
    np.testing.assert_array_equal(plain.speed_m_s, made.observation.speed_m_s)
    assert not plain.clinical.has_pressures
    expected = cuff_pressures(heart, ERRORS, 20260, "development", letter, 3)
    assert (made.observation.clinical.sbp_mmhg, made.observation.clinical.dbp_mmhg) == (
        expected.sbp_mmhg,
        expected.dbp_mmhg,
    )
    assert not made.observation.clinical.has_ejection_time


def test_a_cuff_has_the_bias_and_the_spread_that_are_assumed() -> None:
    heart = replace(HEART, systolic_mmhg=150.0, diastolic_mmhg=60.0)
    read = [cuff_pressures(heart, ERRORS, SEED, STREAM, "a", index) for index in range(2000)]
    off = np.array([(one.sbp_mmhg - 150.0, one.dbp_mmhg - 60.0) for one in read])
    np.testing.assert_allclose(off.mean(axis=0), [0.3, 4.5], atol=0.7)
    np.testing.assert_allclose(off.std(axis=0), [10.0, 8.0], rtol=0.06)
    assert abs(np.corrcoef(off.T)[0, 1]) < 0.08
    assert (off == np.round(off)).all()


def test_no_reading_has_its_pressures_the_wrong_way_round() -> None:
    heart = replace(HEART, systolic_mmhg=80.0, diastolic_mmhg=75.0)
    read = [cuff_pressures(heart, ERRORS, SEED, STREAM, "a", index) for index in range(200)]
    assert all(one.dbp_mmhg < one.sbp_mmhg for one in read)


@pytest.mark.parametrize(
    ("systolic", "diastolic"), [(80.0, 90.0), (np.nan, 70.0), (120.0, np.nan), (np.inf, 70.0)]
)
def test_a_heart_without_pressures_is_refused(systolic: float, diastolic: float) -> None:
    with pytest.raises(ValueError, match="must be pressures, the first no lower than the second"):
        replace(HEART, systolic_mmhg=systolic, diastolic_mmhg=diastolic)


def test_the_root_of_a_stored_beat_follows_from_both_pressures() -> None:
    """P_s + R_p Q with Q = (P_v - P_s)_+ / (R_ao + R_p)."""
    flat = np.full(3, 1.0)
    beat = Beat(flat, flat, flat, np.array([10.0, 120.0, 90.0]), np.array([80.0, 100.0, 95.0]))
    np.testing.assert_allclose(beat.aortic_mmhg(0.9), [80.0, 118.0, 95.0])
    np.testing.assert_array_equal(beat.aortic_mmhg(0.0), beat.arterial_mmhg)


@pytest.mark.parametrize(("letter", "share"), [("e", 0.0), ("f", 7.0e6 / (7.0e6 + 7.69e4))])
def test_stored_hearts_eject_against_the_root_of_their_aorta(letter: str, share: float) -> None:
    """In ejection the cavity is a mmHg or two above it, whoever made the beat."""
    there, provenance = load_hearts(FOLDER / FILES[letter][0])
    assert proximal_share(provenance) == pytest.approx(share)
    for one in there[:10]:
        heart = one.exam_heart(proximal_share(provenance))
        assert heart.systolic_mmhg == pytest.approx(one.beat.ventricular_mmhg.max(), abs=3.0)
        assert heart.diastolic_mmhg < heart.systolic_mmhg - 5.0
