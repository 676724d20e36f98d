from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from cohorts import recording
from numpy.typing import NDArray
from recordings import CONTEXT, PHASES, RECORDING, clean_speed, make_samples, nominal_phase

from data.makers.files import samples_table
from swesbi.artefacts import Provenance
from swesbi.recording.acquisition import TruthCurve, acquire
from swesbi.recording.cohort.clinical import ClinicalRow
from swesbi.recording.cohort.observed import observed_curve
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.recording.phases import locate_phases
from swesbi.recording.quality import rejection
from swesbi.recording.reader import read_samples
from swesbi.recording.samples import ACCEPTED, REASONS, Samples, grouped
from swesbi.recording.settings import ACQUISITION, ContextRow
from swesbi.recording.speed import average_speeds, estimate_noise, repeat_means
from swesbi.recording.tables.layout import TableLayout
from swesbi.seeds import generator


def without_phases(samples: Samples, *indices: int) -> Samples:
    """All attempts at these phases failed; the rows stay."""
    failed = np.isin(samples.phase_index, indices)
    speed = np.where(failed, np.nan, samples.speed_m_s)
    return replace(samples, status=np.where(failed, "no_wave", samples.status), speed_m_s=speed)


def rows(samples: Samples, keep: NDArray[np.bool_]) -> Samples:
    columns = ("gate", "time_ms", "rr_ms", "repeat", "sample", "speed_m_s", "fit_r2", "status")
    return replace(samples, **{name: getattr(samples, name)[keep] for name in columns})


def test_clean_recording_gives_its_speeds_back() -> None:
    observed = ingest(make_samples(), CONTEXT, RECORDING, 100)
    np.testing.assert_allclose(observed.phase, nominal_phase())
    np.testing.assert_allclose(observed.speed_m_s, clean_speed())
    np.testing.assert_allclose(observed.stiffness_kpa, 3.0 * clean_speed() ** 2)
    np.testing.assert_allclose(observed.speed_se_m_s, 0.0, atol=1e-9)
    assert observed.measured.all()
    assert observed.curve_kpa.shape == observed.grid.shape == (100,)
    assert sum(observed.rejected.values()) == 0


def test_samples_are_counted_by_repeat_in_the_order_of_the_phases() -> None:
    samples = make_samples(sample_sd=0.02)
    lost = (samples.phase_index == 3) & (samples.repeat == 1)
    lost |= (samples.phase_index == 5) & (samples.repeat == 2) & (samples.sample < 5)
    failed = replace(samples, status=np.where(lost, "no_wave", samples.status))
    observed = ingest(without_phases(failed, 9), CONTEXT, RECORDING, 100)
    np.testing.assert_array_equal(observed.samples_by_repeat.sum(axis=1), observed.samples_accepted)
    counts = observed.samples_by_repeat[np.argsort(observed.phase_index)]
    assert counts[3, 1] == 0
    assert counts[5].tolist() == [12, 12, 7]
    assert not counts[9].any()


def test_speeds_are_averaged_before_they_are_squared() -> None:
    samples = make_samples(sample_sd=0.1, repeat_sd=0.05)
    observed = ingest(samples, CONTEXT, RECORDING, 100)
    accepted = rejection(samples, RECORDING) == -1
    for index in range(PHASES):
        chosen = accepted & (samples.phase_index == index)
        means = [samples.speed_m_s[chosen & (samples.repeat == r)].mean() for r in range(3)]
        np.testing.assert_allclose(observed.stiffness_kpa[index], 3.0 * np.mean(means) ** 2)
    squared_first = [
        3.0 * np.mean(samples.speed_m_s[accepted & (samples.phase_index == i)] ** 2) for i in range(PHASES)
    ]
    assert np.mean(observed.stiffness_kpa / squared_first) < 0.995


def test_every_sample_is_accepted_or_rejected_for_one_reason() -> None:
    samples = make_samples(sample_sd=0.05, seed=1)
    names = ("status", "speed_m_s", "fit_r2", "rr_ms")
    status, speed, r2, rr = (getattr(samples, name).copy() for name in names)
    status[0:4] = ["no_wave", "motion", "low_r2", "bound_hit"]
    speed[4] = np.nan
    r2[5], r2[6] = 0.2, np.nan
    rr[36:48] = 600.0
    speed[80], speed[90] = 3.0 * speed[80], 0.2 * speed[90]
    changed = dict(zip(names, (status, speed, r2, rr), strict=True))
    observed = ingest(replace(samples, **changed), CONTEXT, RECORDING, 100)
    expected = dict.fromkeys(REASONS, 0) | {"no_wave": 1, "motion": 1, "low_r2": 1, "bound_hit": 1}
    expected |= {"empty_speed": 1, "low_fit_r2": 2, "ectopic_rr": 12, "outlier": 2}
    assert observed.rejected == expected
    assert observed.samples_accepted.sum() + observed.samples_rejected.sum() == len(samples.status)


def test_outlier_rule_holds_at_every_speed_level() -> None:
    samples = make_samples(sample_sd=0.05, seed=3)
    speed = samples.speed_m_s.copy()
    wrong = np.arange(7, len(speed), 36)
    speed[wrong] *= 1.8
    verdict = rejection(replace(samples, speed_m_s=speed), RECORDING)
    assert set(wrong) <= set(np.flatnonzero(verdict == REASONS.index("outlier")))
    assert (verdict != -1).sum() <= len(wrong) + 3


@pytest.mark.parametrize("failed", [(), (7,)], ids=["measured", "not measured"])
def test_an_ectopic_beat_does_not_move_the_phase(failed: tuple[int, ...]) -> None:
    samples = without_phases(make_samples(), *failed)
    rr = np.where((samples.phase_index == 7) & (samples.repeat == 1), 620.0, samples.rr_ms)
    observed = ingest(replace(samples, rr_ms=rr), CONTEXT, RECORDING, 100)
    np.testing.assert_allclose(observed.phase, nominal_phase())


def test_a_beat_counts_once_in_the_usual_rr_however_many_samples_it_gave() -> None:
    samples = make_samples()
    early = samples.repeat == 0
    few = rows(replace(samples, rr_ms=np.where(early, 700.0, 1000.0)), early | (samples.sample < 5))
    assert (few.repeat == 0).mean() > 0.5
    assert few.median_rr_ms == 1000.0
    rejected = rejection(few, RECORDING) == REASONS.index("ectopic_rr")
    np.testing.assert_array_equal(rejected, few.repeat == 0)


def test_standard_error_respects_the_nesting() -> None:
    repeat_sd, sample_sd = 0.04, 0.08
    errors, reported = [], []
    for seed in range(60):
        observed = ingest(
            make_samples(repeat_sd=repeat_sd, sample_sd=sample_sd, seed=seed), CONTEXT, RECORDING, 100
        )
        errors.append(observed.speed_m_s / clean_speed() - 1.0)
        reported.append(observed.speed_se_m_s / observed.speed_m_s)
    actual = np.std(np.concatenate(errors))
    np.testing.assert_allclose(actual, np.sqrt(repeat_sd**2 / 3 + sample_sd**2 / 36), rtol=0.06)
    np.testing.assert_allclose(np.mean(reported), actual, rtol=0.08)
    independent = np.sqrt((repeat_sd**2 + sample_sd**2) / 36)
    assert np.mean(reported) > 1.5 * independent


def test_variance_components_are_told_apart() -> None:
    samples = make_samples(repeat_sd=0.10, sample_sd=0.05, seed=1, repeats=20)
    noise = estimate_noise(repeat_means(samples, np.ones(samples.status.shape, dtype=bool)))
    np.testing.assert_allclose(noise.repeat_fraction, 0.10, rtol=0.08)
    np.testing.assert_allclose(noise.sample_fraction, 0.05, rtol=0.03)


def test_beats_of_different_length_are_not_mistaken_for_noise() -> None:
    cycle = np.arange(400) / 400
    steep = TruthCurve(cycle, 4.0 + 50.0 * np.exp(-0.5 * ((cycle - 0.4) / 0.08) ** 2))
    nothing_else = dict.fromkeys(("sweep_fraction", "failed_fraction", "outlier_fraction"), 0.0)
    settings = ACQUISITION.model_copy(update={"rr_sd_fraction": 0.015} | nothing_else)
    variances = []
    for seed in range(30):
        samples = acquire(steep, CONTEXT, settings, generator(seed, "test"))
        observed = ingest(samples, CONTEXT, RECORDING, 100)
        variances.append(observed.noise.repeat_fraction**2)
    np.testing.assert_allclose(np.sqrt(np.mean(variances)), settings.repeat_sd_fraction, rtol=0.1)


def test_stiffness_error_follows_from_the_speed_error() -> None:
    observed = ingest(make_samples(repeat_sd=0.02, sample_sd=0.04), CONTEXT, RECORDING, 100)
    step = 1e-6
    change = 3.0 * ((observed.speed_m_s + step) ** 2 - observed.speed_m_s**2) / step
    np.testing.assert_allclose(observed.stiffness_se_kpa, change * observed.speed_se_m_s, rtol=1e-5)


def test_a_missing_phase_keeps_its_place_and_is_interpolated() -> None:
    observed = ingest(without_phases(make_samples(), 12), CONTEXT, RECORDING, 100)
    assert not observed.measured[12]
    assert observed.measured.sum() == PHASES - 1
    np.testing.assert_allclose(observed.phase, nominal_phase())
    assert np.isnan(observed.stiffness_kpa[12])
    inside = (observed.grid > observed.phase[11]) & (observed.grid < observed.phase[13])
    between = sorted(observed.stiffness_kpa[[11, 13]])
    assert ((observed.curve_kpa[inside] >= between[0]) & (observed.curve_kpa[inside] <= between[1])).all()


@pytest.mark.parametrize("index", [0, 12, 19])
def test_a_phase_without_rows_lies_between_its_neighbours(index: int) -> None:
    samples = make_samples()
    observed = ingest(rows(samples, samples.phase_index != index), CONTEXT, RECORDING, 100)
    np.testing.assert_allclose(observed.phase, nominal_phase(), atol=1e-12)
    assert list(np.flatnonzero(~observed.measured)) == [index]


def test_a_phase_with_too_few_samples_counts_as_missing() -> None:
    samples = make_samples()
    speed = samples.speed_m_s.copy()
    few = np.flatnonzero(samples.phase_index == 5)
    speed[few[5:]] = np.nan
    observed = ingest(replace(samples, speed_m_s=speed), CONTEXT, RECORDING, 100)
    assert not observed.measured[5]
    assert observed.rejected["sparse_phase"] == 5


def test_limits_themselves_are_allowed() -> None:
    observed = ingest(without_phases(make_samples(), 0, 4, 5, 9), CONTEXT, RECORDING, 100)
    assert observed.measured.sum() == 16


def test_stage_writes_what_it_ingested(tmp_path: Path) -> None:
    samples = without_phases(make_samples(repeat_sd=0.04, sample_sd=0.08), 12)
    samples_table(samples).to_csv(tmp_path / "T.csv", index=False)
    observed = observed_curve(
        tmp_path / "T.csv",
        context=ContextRow(**vars(CONTEXT)),
        clinical_row=ClinicalRow(sbp_mmhg=121.0, dbp_mmhg=78.0),
        recording=RECORDING,
        grid_points=100,
        layout=TableLayout(),
    )
    observed.write(tmp_path / "observation.h5", Provenance("", "T", 1))
    direct, read = ingest(samples, CONTEXT, RECORDING, 100), Observation.read(tmp_path / "observation.h5")
    assert read.context == CONTEXT
    assert (read.clinical.sbp_mmhg, read.clinical.dbp_mmhg) == (121.0, 78.0)
    assert read.clinical.has_pressures and not read.clinical.has_ejection_time
    assert read.noise == direct.noise and read.rejected == direct.rejected
    for name in ("phase", "phase_index", "measured", "speed_m_s", "speed_se_m_s", "curve_kpa"):
        np.testing.assert_array_equal(getattr(read, name), getattr(direct, name))


def read(path: Path, table: pd.DataFrame) -> Samples:
    table.to_csv(path, index=False)
    return read_samples(path, 20, 1000.0)


def test_a_gate_at_the_r_peak_lies_on_both_sides_of_it(tmp_path: Path) -> None:
    """Half of the rows of phase 0 precede the R peak: the mean of 0.99 and 0.01 is 0, and no half beat."""
    table = recording(3).assign(rr_ms=1000)
    table["trigger_delay_ms"] = (50 * table["phase_index"] + 8 * (table["repeat"] - 1)) % 1000
    samples = read(tmp_path / "S.csv", table)
    accepted = rejection(samples, RECORDING) == ACCEPTED
    speeds = average_speeds(samples, accepted, 20)
    located = locate_phases(samples, speeds.beat_phase, np.ones(len(table), dtype=np.bool_))
    np.testing.assert_allclose((located + 0.02) % 1.0, np.arange(20) / 20 + 0.02, atol=0.004)
    without = read(tmp_path / "T.csv", table.assign(trigger_delay_ms=50 * table["phase_index"] + 20))
    noise = average_speeds(without, rejection(without, RECORDING) == ACCEPTED, 20).noise
    assert speeds.noise.repeat_fraction == pytest.approx(noise.repeat_fraction, abs=0.03)


@pytest.mark.parametrize("keys", [["phase"], ["phase", "repeat"]])
def test_groups_are_those_of_pandas(keys: list[str]) -> None:
    rng = np.random.default_rng(3)
    table = pd.DataFrame(
        {"phase": rng.integers(3, 9, 200), "repeat": rng.integers(0, 4, 200), "value": rng.normal(size=200)}
    )
    groups = grouped(*(table[name].to_numpy() for name in keys))
    own = table.groupby(keys)["value"]
    value = table["value"].to_numpy()
    np.testing.assert_array_equal(groups.sizes, own.size())
    np.testing.assert_array_equal(table[keys].to_numpy()[groups.first], own.size().reset_index()[keys])
    for found, expected in (
        (groups.sums(value), own.sum()),
        (groups.means(value), own.mean()),
        (groups.medians(value), own.median()),
        (groups.scatter(value), own.var() * (own.size() - 1)),
    ):
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-14)


def test_of_nothing_there_are_no_groups() -> None:
    groups = grouped(np.zeros(0, np.int64), np.zeros(0, np.int64))
    assert groups.sizes.size == groups.means(np.zeros(0)).size == groups.medians(np.zeros(0)).size == 0
