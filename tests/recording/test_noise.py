from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from recordings import CONTEXT, RECORDING, levels_of, make_samples
from statsmodels.regression.mixed_linear_model import MixedLM

from swesbi.artefacts import Provenance
from swesbi.measurement.speeds import measured_speeds
from swesbi.recording.acquisition import acquire
from swesbi.recording.ingest import ingest
from swesbi.recording.noise.cohort import CohortNoise, fit_cohort, fit_noise
from swesbi.recording.noise.components import RepeatLevels
from swesbi.recording.settings import OTHERS
from swesbi.recording.speed import NoiseComponents
from swesbi.seeds import generator
from swesbi.virtual.volunteers import VOLUNTEERS, simulate_truth

TRUE = NoiseComponents(0.04, 0.08)


def unbalanced(
    repeat_sd: float, sample_sd: float, seed: int, cells: int = 60
) -> tuple[RepeatLevels, NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
    """Two to four repeats a cell of 1 to 14 samples: levels, log speeds, and the cell and repeat of each."""
    rng = np.random.default_rng(seed)
    cell = np.repeat(np.arange(cells), rng.integers(2, 5, cells))
    size = rng.integers(1, 15, cell.size)
    repeat = np.repeat(np.arange(cell.size), size)
    values = 0.3 * np.sin(cell[repeat]) + (repeat_sd * rng.standard_normal(cell.size))[repeat]
    values = values + sample_sd * rng.standard_normal(repeat.size)
    mean = np.bincount(repeat, values) / size
    scatter = np.bincount(repeat, (values - mean[repeat]) ** 2)
    return RepeatLevels(cell, size, mean, scatter), values, cell[repeat], repeat


@pytest.mark.filterwarnings("ignore:The MLE may be on the boundary")
@pytest.mark.parametrize("repeat_sd", [0.04, 0.10])
def test_the_fit_is_that_of_a_general_mixed_model(repeat_sd: float) -> None:
    levels, values, cell, repeat = unbalanced(repeat_sd, 0.08, seed=3)
    general = MixedLM(values, np.eye(levels.cells)[cell], groups=repeat).fit(reml=True)
    found = fit_noise({"X": levels}).pooled
    assert found.repeat.fraction == pytest.approx(float(np.sqrt(general.cov_re[0, 0])), rel=2e-4)
    assert found.sample.fraction == pytest.approx(float(np.sqrt(general.scale)), rel=2e-5)
    assert (found.repeats, found.samples) == (levels.repeats, levels.samples)


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    held = np.zeros(2)
    ratios, count = [], 100
    for seed in range(count):
        repeat, sample = unbalanced(0.04, 0.08, seed)[0].estimates(0.9)[0].values()
        parts = ((repeat, 0.04), (sample, 0.08))
        held += [part.low <= truth <= part.high for part, truth in parts]
        ratios.append([(part.fraction - truth) / part.standard_error for part, truth in parts])
    assert np.abs(held / count - 0.9).max() < 0.09  # three binomial standard errors
    assert np.abs(np.mean(ratios, axis=0)).max() < 0.2
    assert np.abs(np.std(ratios, axis=0) - 1.0).max() < 0.15


def test_components_are_recovered_from_recordings() -> None:
    """Failures, outliers, missing phases, beats of different RR on steep slopes: counts are unbalanced."""
    recordings, sample_sd = {}, 0.05
    for seed in range(4):
        for volunteer in VOLUNTEERS:
            protocol = volunteer.acquisition.model_copy(
                update={
                    "sample_sd_fraction": sample_sd,
                    "repeat_sd_fraction": 0.04,
                    "sweep_fraction": 0.0,
                    "failed_fraction": 0.3,
                }
            )
            rng = generator(seed, "test", "noise", volunteer.context.subject)
            samples = acquire(simulate_truth(volunteer).curve, volunteer.context, protocol, rng)
            recordings[f"{volunteer.context.subject}{seed}"] = levels_of(samples)
    found = fit_noise(recordings)
    assert found.pooled.repeat.low <= 0.04 <= found.pooled.repeat.high
    assert found.pooled.sample.low <= sample_sd <= found.pooled.sample.high
    assert found.pooled.repeat.high - found.pooled.repeat.low < 0.006
    assert found.homogeneity_p > 0.01
    sizes = RepeatLevels.joined(tuple(recordings.values())).size
    assert sizes.max() - sizes.min() >= 7


def test_recordings_of_unequal_noise_are_told_apart() -> None:
    noises = {"X": 0.03, "Y": 0.03, "Z": 0.12}
    recordings = {
        name: levels_of(make_samples(repeat_sd=noise, sample_sd=0.08, seed=5))
        for name, noise in noises.items()
    }
    found = fit_noise(recordings)
    assert found.homogeneity_p < 1e-3
    assert found.by_subject["Z"].repeat.low > found.by_subject["X"].repeat.high


def test_groups_of_recordings_have_noise_of_their_own(tmp_path: Path) -> None:
    """As each has it alone; together the quiet ones would be told loud, and the loud ones quiet."""
    sizes = {"P": 0.5, "R": 1.0, "Q": 0.5, "S": 1.0}
    levels = {
        name: levels_of(make_samples(repeat_sd=0.04 * size, sample_sd=0.08 * size, seed=seed))
        for seed, (name, size) in enumerate(sizes.items())
    }
    noise = fit_cohort(levels, {"P": "quiet", "Q": "quiet"}, 0.9)
    noise.write(tmp_path / "noise.h5", Provenance("", seed=1))
    found = CohortNoise.read(tmp_path / "noise.h5")
    assert found == noise and found.group_of == {"P": "quiet", "Q": "quiet", "R": OTHERS, "S": OTHERS}
    for group in (("P", "Q"), ("R", "S")):
        alone = fit_noise({name: levels[name] for name in group}, 0.9)
        assert found.of(group[0]) == found.of(group[1]) == alone.pooled.components
    together = fit_noise(levels, 0.9)
    assert together.homogeneity_p < 1e-6 < min(group.homogeneity_p for group in found.groups.values())
    assert found.usual == found.of("R")
    assert found.of("P").repeat_fraction < 0.7 * together.pooled.repeat.fraction


def test_no_noise_between_repeats_has_an_interval_from_zero() -> None:
    found = fit_noise({"X": unbalanced(0.0, 0.08, seed=11)[0]}).pooled.repeat
    assert found.low == 0.0
    assert found.fraction <= found.high < 0.03


@pytest.mark.parametrize(
    ("levels", "what"),
    [
        (RepeatLevels(np.arange(3), np.full(3, 9), np.zeros(3), np.ones(3)), "between repeats"),
        (RepeatLevels(np.array([0, 0]), np.array([1, 1]), np.zeros(2), np.zeros(2)), "between samples"),
        (RepeatLevels(np.array([0, 0]), np.array([5, 5]), np.zeros(2), np.zeros(2)), "no noise"),
    ],
)
def test_recordings_that_cannot_tell_a_component_are_refused(levels: RepeatLevels, what: str) -> None:
    with pytest.raises(ValueError, match=f"^X: .*{what}"):
        fit_noise({"X": levels})


def test_a_recording_uses_its_own_components_or_those_of_the_cohort() -> None:
    observed = ingest(make_samples(repeat_sd=0.02, sample_sd=0.05, seed=2), CONTEXT, RECORDING, 100)
    own = measured_speeds(observed)
    np.testing.assert_allclose(own.relative_se, observed.speed_se_m_s / observed.speed_m_s, rtol=1e-12)
    doubled = NoiseComponents(2 * observed.noise.repeat_fraction, 2 * observed.noise.sample_fraction)
    np.testing.assert_allclose(measured_speeds(observed, doubled).relative_se, 2 * own.relative_se)


def test_one_recording_has_no_test_of_homogeneity(tmp_path: Path) -> None:
    noise = fit_noise({"X": unbalanced(0.04, 0.08, seed=1)[0]})
    assert np.isnan(noise.homogeneity_p)
    cohort = CohortNoise({"quiet": noise}, 0.9)
    cohort.write(tmp_path / "noise.h5", Provenance("", seed=1))
    again = CohortNoise.read(tmp_path / "noise.h5").groups["quiet"]
    assert again.pooled == noise.pooled and list(again.by_subject) == ["X"]
