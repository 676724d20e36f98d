"""The noise of a folder: of many recordings their own, of one what its repeats do not tell is expected."""

from __future__ import annotations

import numpy as np
import pytest
from recordings import make_samples

from swesbi.recording.noise.cohort import FolderRecordings, fit_noise, folder_noise
from swesbi.recording.noise.components import RepeatLevels
from swesbi.recording.settings import NoisePriorSettings

PRIOR = NoisePriorSettings(repeat_fraction=0.03, sample_fraction=0.06, sweep_fraction=0.015, log_sd=0.7)


def recording(repeat_sd: float, sample_sd: float, seed: int) -> RepeatLevels:
    samples = make_samples(repeat_sd=repeat_sd, sample_sd=sample_sd, seed=seed)
    return RepeatLevels.of(samples, np.ones(len(samples.speed_m_s), dtype=bool))


def folder(count: int, repeat_sd: float, sample_sd: float, first: int = 0) -> dict[str, RepeatLevels]:
    return {f"S{seed:02d}": recording(repeat_sd, sample_sd, first + seed) for seed in range(count)}


@pytest.mark.parametrize("factor", [0.7, 1.5, 2.0])
def test_many_recordings_have_their_own_noise_whatever_is_expected(factor: float) -> None:
    levels = folder(20, factor * 0.03, factor * 0.06)
    found, reml = folder_noise(list(levels.values()), PRIOR), fit_noise(levels).pooled.components
    assert found.recordings == 20
    np.testing.assert_allclose(
        [found.components.repeat_fraction, found.components.sample_fraction],
        [reml.repeat_fraction, reml.sample_fraction],
        rtol=0.01,
    )
    assert found.components.repeat_fraction == pytest.approx(factor * 0.03, rel=0.15)


def test_without_recordings_it_is_what_is_expected_and_one_lies_between() -> None:
    none = folder_noise([], PRIOR)
    assert (none.recordings, none.components.repeat_fraction) == (0, pytest.approx(0.03))
    loud = recording(0.12, 0.24, 1)
    alone = fit_noise({"S": loud}).pooled.components
    one = folder_noise([loud], PRIOR)
    assert 0.03 < one.components.repeat_fraction < 0.97 * alone.repeat_fraction
    assert "one recording and typical values together" in one.in_words
    # of its samples it has hundreds, of its repeats some forty
    assert one.components.sample_fraction == pytest.approx(alone.sample_fraction, rel=0.01)


def test_neither_the_order_nor_the_names_of_recordings_matter() -> None:
    levels = folder(6, 0.04, 0.08)
    backwards = dict(reversed(levels.items()))
    one, other = (folder_noise(list(each.values()), PRIOR).components for each in (levels, backwards))
    np.testing.assert_allclose(list(vars(one).values()), list(vars(other).values()), rtol=1e-4)


@pytest.mark.parametrize("count", [2, 5, 30])
def test_a_recording_like_the_others_is_rarely_flagged_and_one_twice_as_loud_is_found(count: int) -> None:
    alike = []
    for first in range(0, 40, 4):
        recordings = FolderRecordings(folder(count, 0.04, 0.08, 100 * first), PRIOR)
        alike += [recordings.compared(name).p_value for name in list(recordings.levels)[:4]]
    assert np.mean(np.array(alike) < 0.1) <= 0.3
    levels = folder(count, 0.04, 0.08) | {"loud": recording(0.08, 0.16, 999)}
    assert FolderRecordings(levels, PRIOR).compared("loud").p_value < 1e-3


@pytest.mark.parametrize("loudness", [1.15, 0.85])
def test_what_the_others_gain_by_a_noise_of_their_own_counts_for_a_difference(loudness: float) -> None:
    """Of two recordings with nothing expected, it is REML's test that both have the same components."""
    levels = {"quiet": recording(0.04, 0.08, 1), "other": recording(0.04 * loudness, 0.08 * loudness, 2)}
    nothing = PRIOR.model_copy(update={"log_sd": 1e3})
    expected = fit_noise(levels).homogeneity_p
    assert 1e-6 < expected < 0.1
    for name in levels:
        assert FolderRecordings(levels, nothing).compared(name).p_value == pytest.approx(expected, rel=0.01)


def test_declared_groups_of_a_folder_are_estimated_and_compared_apart() -> None:
    quiet, loud = folder(3, 0.02, 0.04), folder(3, 0.04, 0.08, 50)
    levels = {f"Q{name}": own for name, own in quiet.items()} | {
        f"L{name}": own for name, own in loud.items()
    }
    mixed = FolderRecordings(levels, PRIOR)
    apart = FolderRecordings(levels, PRIOR, {name: "quiet" for name in levels if name.startswith("Q")})
    for group, first in ((quiet, "QS00"), (loud, "LS00")):
        assert apart.noise(first) == folder_noise(list(group.values()), PRIOR)
        assert apart.compared(first).p_value > 0.01 > mixed.compared(first).p_value


def test_a_recording_alone_in_its_folder_is_compared_with_nobody() -> None:
    assert FolderRecordings(folder(1, 0.04, 0.08), PRIOR).compared("S00") is None
