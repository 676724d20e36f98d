from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from cohorts import write_cohort
from numpy.typing import NDArray
from recordings import CONTEXT, PHASES, RECORDING, make_samples
from scipy.optimize import minimize
from scipy.stats import chi2, norm
from statsmodels.regression.mixed_linear_model import MixedLM

from swesbi.__main__ import main
from swesbi.recording.acquisition import TruthCurve, acquire
from swesbi.recording.cohort.recording_file import noise_groups_of, read_recording_file
from swesbi.recording.ingest import ingest
from swesbi.recording.noise.cohort import compare_noise, fit_noise
from swesbi.recording.noise.components import (
    LARGEST_SD,
    ComponentEstimate,
    RepeatLevels,
    log_restricted_likelihood,
)
from swesbi.recording.noise.errors import mean_errors, relative_se
from swesbi.recording.noise.sweeps import SweepLevels, levels_by
from swesbi.recording.problems import RecordingError
from swesbi.recording.quality import rejection
from swesbi.recording.samples import ACCEPTED, Samples
from swesbi.recording.speed import NoiseComponents
from swesbi.seeds import generator
from swesbi.virtual.volunteers import VOLUNTEERS, simulate_truth

TRUE = NoiseComponents(0.04, 0.08, 0.05)
OWN = {
    "samples_per_repeat": 12,
    "repeat_sd_fraction": 0.04,
    "sample_sd_fraction": 0.08,
    "scale_fraction": 0.0,
}
"""Of recordings with these components, but sweeps."""


def levels_of_table(table: pd.DataFrame) -> SweepLevels:
    """The repeats of one recording, from a row per sample: phase, sweep, value."""
    by_repeat = table.groupby(["phase", "sweep"])["value"]
    place = by_repeat.size().index
    scatter = by_repeat.apply(lambda values: ((values - values.mean()) ** 2).sum())
    return SweepLevels(
        np.unique(place.get_level_values("phase"), return_inverse=True)[1].astype(np.int64),
        by_repeat.size().to_numpy(np.int64),
        by_repeat.mean().to_numpy(np.float64),
        scatter.to_numpy(np.float64),
        np.zeros(len(place), np.int64),
        np.unique(place.get_level_values("sweep"), return_inverse=True)[1].astype(np.int64),
    )


def crossed(
    noise: NoiseComponents,
    seed: int,
    recordings: int = 4,
    phases: int = 8,
    sweeps: int = 3,
) -> pd.DataFrame:
    """Log speeds of sweeps, some of which miss a phase, with 1 to 6 samples a repeat."""
    rng = np.random.default_rng(seed)
    table = pd.MultiIndex.from_product(
        [range(recordings), range(phases), range(sweeps)], names=["recording", "phase", "sweep"]
    ).to_frame(index=False)
    shared = noise.sweep_fraction * rng.standard_normal((recordings, sweeps))
    table["value"] = 0.3 * np.sin(table["phase"]) + shared[table["recording"], table["sweep"]]
    table["value"] += noise.repeat_fraction * rng.standard_normal(len(table))
    table = table[rng.random(len(table)) >= 0.15]
    table = table.loc[table.index.repeat(rng.integers(1, 7, len(table)))].reset_index(drop=True)
    return table.assign(value=table["value"] + noise.sample_fraction * rng.standard_normal(len(table)))


def levels_of(table: pd.DataFrame) -> SweepLevels:
    return SweepLevels.joined([levels_of_table(part) for _, part in table.groupby("recording")])


def separate(levels: SweepLevels) -> RepeatLevels:
    """Return the same repeats, each phase taken as repeated by itself."""
    return RepeatLevels(levels.cell, levels.size, levels.mean, levels.scatter)


def parts_of(levels: RepeatLevels) -> tuple[ComponentEstimate, ...]:
    return tuple(levels.estimates(0.9)[0].values())


def test_the_likelihood_is_that_of_the_whole_covariance_matrix() -> None:
    table = crossed(TRUE, seed=4, recordings=2, phases=5)
    cell = table.groupby(["recording", "phase"]).ngroup().to_numpy()
    repeat = table.groupby(["recording", "phase", "sweep"]).ngroup().to_numpy()
    sweep = table.groupby(["recording", "sweep"]).ngroup().to_numpy()
    values = table["value"].to_numpy()

    def dense(repeat_sd: float, sample_sd: float, sweep_sd: float) -> float:
        covariance = repeat_sd**2 * (repeat[:, None] == repeat) + sample_sd**2 * np.eye(values.size)
        covariance = covariance + sweep_sd**2 * (sweep[:, None] == sweep)
        design, inverse = np.eye(cell.max() + 1)[cell], np.linalg.inv(covariance)
        information = design.T @ inverse @ design
        residual = values - design @ np.linalg.solve(information, design.T @ inverse @ values)
        determinants = np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(information)[1]
        return float(-0.5 * (determinants + residual @ inverse @ residual))

    points = [(0.04, 0.08, 0.05), (0.0, 0.1, 0.02), (0.1, 0.05, 0.0), (0.01, 0.2, 0.3)]
    levels = levels_of(table)
    ours = np.array([levels.log_likelihood(NoiseComponents(*point)) for point in points])
    np.testing.assert_allclose(np.diff(ours), np.diff([dense(*point) for point in points]), rtol=1e-9)


def test_without_sweep_noise_the_likelihood_is_that_of_separate_repeats() -> None:
    levels = levels_of(crossed(TRUE, seed=5))
    for pair in ((0.04, 0.08), (0.0, 0.1), (0.2, 0.05)):
        crossed_value = levels.log_likelihood(NoiseComponents(*pair))
        assert crossed_value == pytest.approx(
            separate(levels).log_likelihood(NoiseComponents(*pair)), rel=1e-13
        )


@pytest.mark.filterwarnings("ignore:The MLE may be on the boundary")
@pytest.mark.parametrize("seed", [2, 3])
def test_the_fit_is_that_of_a_general_mixed_model(seed: int) -> None:
    table = crossed(TRUE, seed, phases=5, sweeps=4)
    table = table.assign(cell=table.groupby(["recording", "phase"]).ngroup())
    general = MixedLM.from_formula(
        "value ~ 0 + C(cell)",
        groups="recording",
        vc_formula={"sweep": "0 + C(sweep)", "repeat": "0 + C(sweep):C(phase)"},
        re_formula="0",
        data=table,
    ).fit(reml=True, method="bfgs", gtol=1e-9)
    assert general.converged
    by_name = dict(zip(general.model.exog_vc.names, general.vcomp, strict=True))
    found = parts_of(levels_of(table))
    expected = [np.sqrt(by_name["repeat"]), np.sqrt(general.scale), np.sqrt(by_name["sweep"])]
    np.testing.assert_allclose([part.fraction for part in found[:3]], expected, rtol=1e-6)


def test_an_interval_ends_where_the_best_of_the_other_components_says_as_little() -> None:
    levels = levels_of(crossed(TRUE, seed=1, recordings=8))
    parts, top = parts_of(levels), levels.maximum[1]
    middle = np.array([part.fraction for part in parts])

    def below(index: int, sd: float) -> float:
        """How far the likelihood falls where a component is fixed and the others are chosen by simplex."""

        def loss(others: NDArray[np.float64]) -> float:
            return -levels.log_likelihood(NoiseComponents(*np.insert(np.abs(others), index, sd)))

        others, options = np.delete(middle, index), {"xatol": 1e-7, "fatol": 1e-7}
        return float(minimize(loss, others, method="Nelder-Mead", options=options).fun + top)

    for index, part in enumerate(parts):
        step = 0.02 * part.fraction
        assert part.low > 0.0
        for end in (part.low, part.high):
            assert below(index, end) == pytest.approx(0.5 * norm.ppf(0.95) ** 2, abs=1e-4)
        curvature = below(index, part.fraction + step) + below(index, part.fraction - step)
        assert step / np.sqrt(curvature) == pytest.approx(part.standard_error, rel=0.02)


@pytest.mark.exhaustive
def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    truth = np.array([TRUE.repeat_fraction, TRUE.sample_fraction, TRUE.sweep_fraction])
    fits = [parts_of(levels_of(crossed(TRUE, seed, recordings=10))) for seed in range(100, 200)]
    found, error, low, high = (
        np.array([[getattr(part, name) for part in fit] for fit in fits])
        for name in ("fraction", "standard_error", "low", "high")
    )
    held = ((low <= truth) & (truth <= high)).mean(axis=0)
    assert np.abs(held - 0.9).max() < 0.09  # three binomial standard errors
    np.testing.assert_allclose(found.mean(axis=0), truth, rtol=0.07)
    np.testing.assert_allclose(found.std(axis=0), error.mean(axis=0), rtol=0.22)


@cache
def acquired(sweep_fraction: float, seeds: range) -> dict[str, Samples]:
    """Recordings of the volunteers: failures, outliers, missing phases, beats of different RR."""
    made = {}
    for seed in seeds:
        for volunteer in VOLUNTEERS:
            protocol = volunteer.acquisition.model_copy(update=OWN | {"sweep_fraction": sweep_fraction})
            rng = generator(seed, "test", "sweeps", volunteer.context.subject)
            name = f"{volunteer.context.subject}{seed}"
            made[name] = acquire(simulate_truth(volunteer).curve, volunteer.context, protocol, rng)
    return made


def by(repeats: str, recordings: dict[str, Samples]) -> dict[str, RepeatLevels]:
    return {
        name: levels_by(repeats, samples, rejection(samples, RECORDING) == ACCEPTED)  # type: ignore[arg-type]
        for name, samples in recordings.items()
    }


def pooled(recordings: dict[str, Samples]) -> tuple[ComponentEstimate, ...]:
    """The components of sweeps of all recordings, none of which is fitted alone."""
    found = by("sweeps", recordings).values()
    return parts_of(SweepLevels.joined([each for each in found if isinstance(each, SweepLevels)]))


def test_components_are_recovered_from_recordings_and_only_with_the_crossed_term() -> None:
    recordings = acquired(0.05, range(3))
    repeat, sample, sweep = pooled(recordings)
    for part, true in ((repeat, 0.04), (sample, 0.08), (sweep, 0.05)):
        assert part.low <= true <= part.high
    assert repeat.high - repeat.low < 0.006
    assert sweep.high - sweep.low < 0.025
    nested = fit_noise(by("separate", recordings)).pooled.repeat
    assert nested.low > 0.045
    assert nested.fraction == pytest.approx(np.hypot(0.04, 0.05), rel=0.2)


def test_separate_repeats_have_no_sweep_noise() -> None:
    repeat, _, sweep = pooled(acquired(0.0, range(2)))
    assert sweep.low == 0.0
    assert sweep.high < 0.012
    assert repeat.low <= 0.04 <= repeat.high


def test_a_component_of_zero_is_zero_with_an_interval_from_there() -> None:
    fits = [parts_of(levels_of(crossed(NoiseComponents(0.0, 0.08, 0.0), seed))) for seed in range(8)]
    for index in (0, 2):
        parts = [fit[index] for fit in fits]
        zero = [part for part in parts if part.fraction == 0.0]
        assert zero
        assert all(part.low == 0.0 and np.isnan(part.standard_error) for part in zero)
        assert all(0.0 <= part.fraction < part.high < 0.06 for part in parts)


def test_two_sweeps_of_one_recording_bound_their_noise_from_below_at_most() -> None:
    apart = parts_of(levels_of(crossed(TRUE, 1, recordings=1, phases=20, sweeps=2)))[2]
    loud = replace(TRUE, sweep_fraction=0.6)
    found = [
        parts_of(levels_of(crossed(loud, seed, recordings=1, phases=20, sweeps=2)))[2] for seed in range(4)
    ]
    assert apart.high > 3.0 * apart.fraction
    assert max(part.high for part in found) == LARGEST_SD


def test_sweeps_of_other_numbers_at_each_phase_are_refused() -> None:
    table = crossed(TRUE, seed=1)
    apart = levels_of(table.assign(sweep=table["phase"] * 10 + table["sweep"]))
    with pytest.raises(ValueError, match=r"^X: no sweep has samples at two phases.*same repeat number"):
        fit_noise({"X": apart})
    once = levels_of(table[table["phase"] == table["sweep"]])
    with pytest.raises(ValueError, match="no phase was measured twice"):
        fit_noise({"X": once})


def test_recordings_of_sweeps_and_of_separate_repeats_are_not_pooled() -> None:
    levels = levels_of(crossed(TRUE, seed=1))
    with pytest.raises(ValueError, match="1 of 2 recordings are of sweeps"):
        fit_noise({"X": levels, "Y": separate(levels)})


def test_a_recording_is_compared_with_the_cohort_by_the_model_of_its_repeats() -> None:
    crossed_levels = levels_of(crossed(TRUE, seed=1, recordings=1, phases=20))
    top = crossed_levels.maximum[1]
    given = crossed_levels.log_likelihood(TRUE)
    found = compare_noise(crossed_levels, TRUE)
    assert found.statistic == pytest.approx(2.0 * (top - given))
    assert found.p_value == pytest.approx(chi2.sf(found.statistic, 3))
    levels = separate(crossed_levels)
    top = levels.maximum[1]
    given = log_restricted_likelihood(levels, float(np.hypot(0.04, 0.05)), 0.08)
    assert compare_noise(levels, TRUE).statistic == pytest.approx(2.0 * (top - given))


@pytest.mark.slow(minutes=0.2)
def test_of_recordings_compared_with_the_cohort_those_with_other_noise_are_told() -> None:
    def p_values(noise: NoiseComponents, count: int) -> NDArray[np.float64]:
        made = [levels_of(crossed(noise, seed, recordings=1, phases=12)) for seed in range(count)]
        return np.array([compare_noise(levels, TRUE).p_value for levels in made])

    alike = p_values(TRUE, 20)
    assert (alike <= 0.05).mean() <= 0.2
    assert 0.3 < alike.mean() < 0.7
    assert (p_values(replace(TRUE, sweep_fraction=0.3), 10) <= 0.05).mean() >= 0.4  # of three sweeps each
    assert (p_values(replace(TRUE, repeat_fraction=0.1), 10) <= 0.05).mean() >= 0.7


def test_means_over_the_same_sweeps_share_their_error() -> None:
    found = mean_errors(np.full((5, 3), 12), TRUE)
    np.testing.assert_allclose(found.own, np.sqrt((0.04**2 + 0.08**2 / 12) / 3))
    np.testing.assert_allclose(found.shared @ found.shared.T, np.full((5, 5), 0.05**2 / 3))


def test_a_sweep_that_misses_a_phase_shares_nothing_with_it() -> None:
    counts = np.array([[12, 12, 0], [0, 3, 12], [12, 0, 0]])
    found = mean_errors(counts, TRUE)
    shared = 0.05**2 * np.array([[1 / 2, 1 / 4, 1 / 2], [1 / 4, 1 / 2, 0.0], [1 / 2, 0.0, 1.0]])
    np.testing.assert_allclose(found.shared @ found.shared.T, shared)
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), relative_se(counts, TRUE))
    assert np.isnan(mean_errors(np.array([[0, 0, 0]]), TRUE).own).all()


def test_separate_repeats_share_nothing_and_keep_their_standard_errors_to_the_bit() -> None:
    counts = np.array([[12, 12, 12], [12, 3, 0], [7, 5, 1]])
    noise = NoiseComponents(0.04, 0.08)
    found = mean_errors(counts, noise)
    per_repeat = np.where(counts > 0, 0.04**2 + 0.08**2 / np.maximum(counts, 1), 0.0)
    before = np.sqrt(per_repeat.sum(axis=1)) / (counts > 0).sum(axis=1)
    np.testing.assert_array_equal(relative_se(counts, noise), before)
    np.testing.assert_array_equal(found.own, before)
    assert found.shared.shape == (3, 0)
    np.testing.assert_array_equal(found.total, before)
    apart = mean_errors(counts, TRUE.of_separate_repeats)
    assert apart.shared.shape == (3, 0)
    np.testing.assert_allclose(apart.own, relative_se(counts, TRUE))
    np.testing.assert_allclose(mean_errors(counts, TRUE).total, relative_se(counts, TRUE))


def test_the_covariance_is_that_of_recordings() -> None:
    """A third of the sweeps of every second phase failed; 300 recordings of a flat curve."""
    flat = TruthCurve(np.arange(100) / 100, np.full(100, 12.0))
    protocol = VOLUNTEERS[0].acquisition.model_copy(
        update=OWN | {"sweep_fraction": 0.05, "failed_fraction": 0.0, "outlier_fraction": 0.0}
    )
    logs = []
    for seed in range(300):
        samples = acquire(flat, CONTEXT, protocol, generator(seed, "test", "covariance"))
        lost = (samples.repeat == samples.phase_index % 6 // 2) & (samples.phase_index % 2 == 1)
        samples = replace(samples, status=np.where(lost, "no_wave", samples.status))
        observed = ingest(samples, CONTEXT, RECORDING, 100)
        logs.append(np.log(observed.speed_m_s))
    expected = mean_errors(observed.samples_by_repeat, TRUE).covariance
    found = np.cov(np.array(logs), rowvar=False)
    apart = ~np.eye(PHASES, dtype=bool)
    assert found[apart].mean() == pytest.approx(expected[apart].mean(), rel=0.15)
    assert np.diag(found).mean() == pytest.approx(np.diag(expected).mean(), rel=0.10)
    odd, even = np.arange(1, PHASES, 2), np.arange(0, PHASES, 2)
    for one, other in ((odd, odd), (odd, even), (even, even)):
        block = np.ix_(one, other)
        kept = apart[block]
        assert found[block][kept].mean() == pytest.approx(expected[block][kept].mean(), rel=0.2)


@pytest.mark.parametrize(
    ("said", "found"),
    [
        ("", {}),
        ("noise_groups:", {}),
        ("noise_groups: {quiet: [P], loud: [Q]}", {"P": "quiet", "Q": "loud"}),
        ("noise_groups: {others: [P]}", "`noise_groups.others`: the recordings that no group names"),
        ("noise_groups: {quiet: P}", "under the key `noise_groups"),
        ("noise_groups: [P]", "under the key `noise_groups"),
        ("noise_groups: {quiet: [P, Z]}", "'Z' .*`noise_groups.quiet` is no subject of subjects.csv"),
        ("noise_groups: {quiet: [P], loud: [P]}", "'P' .*`noise_groups.loud` is in quiet too"),
    ],
)
def test_groups_are_read_or_refused(tmp_path: Path, said: str, found: dict[str, str] | str) -> None:
    path = tmp_path / "recording.yaml"
    path.write_text(f"origin: a\n{said}\n", encoding="utf-8")
    if isinstance(found, dict):
        assert noise_groups_of(read_recording_file(tmp_path), path, ("P", "Q", "R")) == found
        return
    with pytest.raises(RecordingError) as refused:
        noise_groups_of(read_recording_file(tmp_path), path, ("P", "Q", "R"))
    assert re.search(found, str(refused.value).replace("\n", " ")), refused.value


def test_validation_refuses_sweeps_that_have_another_number_at_each_phase(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cohort = write_cohort(tmp_path / "cohort")
    protocol = cohort / "recording.yaml"
    protocol.write_text(protocol.read_text() + "  repeats_are: sweeps\n")
    assert main(["validate", str(cohort)]) == 0
    path = cohort / "swe" / "S-1.csv"
    table = pd.read_csv(path)
    table.assign(repeat=10 * table["phase_index"] + table["repeat"]).to_csv(path, index=False)
    capsys.readouterr()
    assert main(["validate", str(cohort)]) == 2
    shown = capsys.readouterr().err
    assert "S-1.csv, column 'repeat': no sweep has samples at two phases" in shown
    assert "give a sweep the same repeat number at all its phases" in shown
    protocol.write_text(protocol.read_text().replace("sweeps", "separate"))
    assert main(["validate", str(cohort)]) == 0


def test_sweeps_are_numbered_as_in_the_recording() -> None:
    samples = make_samples(repeat_sd=0.04, sample_sd=0.08, seed=1)
    later = replace(samples, repeat=samples.repeat * 7 + 3)
    accepted = rejection(later, RECORDING) == ACCEPTED
    levels = levels_by("sweeps", later, accepted)
    assert isinstance(levels, SweepLevels)
    np.testing.assert_array_equal(levels.sweep, np.tile(np.arange(3), PHASES))
