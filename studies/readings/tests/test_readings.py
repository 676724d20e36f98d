"""Readings of the paper's text: what each does to recordings, curves, networks and synthetic recordings."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError
from study_copy import ROOT, StudyCopy

from data.makers.noise_levels import through_phases
from studies.acquisition_seeds.settings import judged_settings
from studies.acquisition_seeds.truth import truth_of
from studies.readings import stages as stage
from studies.readings.chain import Case, ChainSettings, predictive_curves, reading_pool
from studies.readings.recordings import ERRORS, passive_scale_error, treated_subject, with_errors
from studies.readings.recovery import stretched_after_peak, synthetic_cycles, synthetic_recordings
from studies.readings.settings import (
    Reading,
    ReadingsSettings,
    Treatment,
    WeightsSettings,
    cmaes_settings,
    run_settings,
    seeds_settings,
)
from studies.readings.treatment import ALIGNED_PEAK, Features, smooth_cycle
from studies.readings.weights import fits_by_weights
from swesbi.artefacts import ArtefactError, Origin
from swesbi.checks.settings import CmaesSettings, CurveLossSettings
from swesbi.config.read import ConfigError, overlay, parse_section, read_merged, read_yaml
from swesbi.config.study import load_study
from swesbi.heart.prior_simulations import draw_simulations
from swesbi.measurement.likelihood import MeasuredSubject, reference_beat
from swesbi.measurement.operator import calibrate_passive, late_diastolic, total_cycle
from swesbi.measurement.settings import SCALAR_NAMES
from swesbi.measurement.summary import summarise
from swesbi.prior import log_centre
from swesbi.recording.acquisition_settings import ACQUISITION
from swesbi.recording.ingest import ingest
from swesbi.recording.phases import analysis_grid
from swesbi.recording.reader import read_samples
from swesbi.virtual.volunteers import VOLUNTEERS

SHIPPED = overlay(read_merged(ROOT / "config.yaml"), read_yaml(ROOT / "tests" / "smoke.yaml"))
SHIPPED |= {"cohort": str(ROOT / "data" / "virtual_volunteers")}
FOLDER = ROOT / "studies" / "readings"
SECTION = read_yaml(FOLDER / "config.yaml")["readings"]
SIZES = read_yaml(FOLDER / "small.yaml")["readings"] | {"readings": {}}
SMALL = parse_section(overlay(SECTION, SIZES), "readings", ReadingsSettings)
"""Every reading in small sizes."""
TIME_TO_PEAK = SCALAR_NAMES.index("time_to_peak_cycle")
GRID = analysis_grid(100)
SEED = 5


def chain(**changes: object) -> ChainSettings:
    plain = run_settings(load_study(SHIPPED), SMALL, "base")["chain"]
    return ChainSettings.from_plain(plain | {"simulations_per_subject": 12} | changes)


@cache
def subject(name: str = "A") -> MeasuredSubject:
    """A shipped recording with the passive baseline of the study."""
    settings = chain()
    context = next(v.context for v in VOLUNTEERS if v.context.subject == name)
    path = ROOT / "data" / "virtual_volunteers" / "swe" / f"{name}.csv"
    samples = read_samples(path, settings.recording.phases, settings.recording.density_kg_m3)
    observed = ingest(samples, context, settings.recording, settings.measurement.grid_points)
    reference = reference_beat(context, settings.passive_reference_prior, settings.forward_model)
    passive = calibrate_passive(observed, reference, settings.passive, settings.measurement)
    return MeasuredSubject(observed, passive, settings.measurement)


@cache
def case(name: str = "A") -> Case:
    settings, context = chain(), subject(name).observation.context
    return Case(
        subject(name), draw_simulations(range(12), context, settings.prior, settings.forward_model, SEED)
    )


def features(**treatment: Any) -> Features:  # noqa: ANN401
    settings = chain()
    return Features(settings.summary, Treatment(**treatment), settings.observation_model)


def bells(centres: list[float]) -> NDArray[np.float64]:
    away = (GRID - np.array(centres)[:, None] + 0.5) % 1.0 - 0.5
    return 4.0 + 50.0 * np.exp(-0.5 * (away / 0.08) ** 2)


def test_smoothing_keeps_the_mean_and_widens_a_bell_as_two_gaussians_do() -> None:
    curves = bells([0.4, 0.95])
    smooth = smooth_cycle(curves, 0.03)
    np.testing.assert_allclose(smooth[:, :-1].mean(axis=1), curves[:, :-1].mean(axis=1))
    np.testing.assert_allclose(smooth[:, 0], smooth[:, -1])
    widened = 4.0 + 50.0 * 0.08 / np.hypot(0.08, 0.03)
    np.testing.assert_allclose(smooth.max(axis=1), widened, rtol=0.01)
    assert smooth_cycle(curves, 0.0) is curves


def test_aligned_trajectories_are_alike_and_their_scalars_are_not() -> None:
    curves = bells([0.33, 0.4, 0.47])
    plain, aligned = features().of(curves), features(aligned=True).of(curves)
    np.testing.assert_array_equal(aligned[:, : len(SCALAR_NAMES)], plain[:, : len(SCALAR_NAMES)])
    np.testing.assert_allclose(np.diff(plain[:, TIME_TO_PEAK]), 0.07, atol=1e-3)
    spread = np.ptp(aligned[:, len(SCALAR_NAMES) :], axis=0)
    assert spread.max() < 0.6 < 0.05 * np.ptp(plain[:, len(SCALAR_NAMES) :], axis=0).max()
    at_peak = aligned[:, len(SCALAR_NAMES) + round(ALIGNED_PEAK * 30)]
    np.testing.assert_allclose(at_peak, 54.0, rtol=0.005)


def test_smoothed_features_are_those_of_smoothed_curves() -> None:
    curves = bells([0.4])
    np.testing.assert_array_equal(
        features(smoothing_cycle=0.03).of(curves), summarise(smooth_cycle(curves, 0.03), chain().summary)
    )
    of_recordings = features(smoothing_cycle=0.03, smoothed="recordings")
    np.testing.assert_array_equal(of_recordings.of(curves), features().of(curves))


def test_noise_on_curves_takes_that_of_maximum_and_time_to_peak_off_the_features() -> None:
    plain, noisy = features(), features(curve_noise=True)
    assert set(plain.on_features) - set(noisy.on_features) == {"maximum_kpa", "time_to_peak_cycle"}
    drawn = noisy.observed(np.repeat(bells([0.4]), 2000, axis=0), np.random.default_rng(1))
    sd = noisy.observation_model.feature_noise_sd
    for name in ("maximum_kpa", "time_to_peak_cycle"):
        np.testing.assert_allclose(
            drawn[:, SCALAR_NAMES.index(name)].std(), sd[name], rtol=0.06, err_msg=name
        )


def test_without_other_errors_or_smoothing_the_recording_is_the_study_s() -> None:
    assert treated_subject(subject(), Treatment(aligned=True, curve_noise=True), chain()) is subject()


def test_a_recording_with_the_shipped_errors_is_the_shipped_one() -> None:
    again = treated_subject(subject(), Treatment(noise_factor=1.0 + 1e-12), chain())
    np.testing.assert_array_equal(again.observation.curve_kpa, subject().observation.curve_kpa)
    assert again.passive.scale_kpa == subject().passive.scale_kpa


def test_recordings_come_nearer_the_truth_with_smaller_errors() -> None:
    truth = truth_of(subject().observation.context)
    away = []
    for factor in (0.0, 0.25, 1.0, 2.0):
        observed = treated_subject(subject(), Treatment(noise_factor=factor + 1e-12), chain()).observation
        true = through_phases(truth.curve, observed.measured_phase, len(observed.grid))
        away.append(float(np.sqrt(np.mean((observed.curve_kpa - true) ** 2))))
    assert away == sorted(away)
    assert away[0] < 0.3 * away[2]
    assert {n: getattr(with_errors(ACQUISITION, 0.5), n) for n in ERRORS} == {
        name: 0.5 * getattr(ACQUISITION, name) for name in ERRORS
    }


def test_a_smoothed_recording_has_its_passive_baseline_from_its_own_curve() -> None:
    treatment = Treatment(smoothing_cycle=0.025, smoothed="recordings")
    smooth = treated_subject(subject(), treatment, chain())
    np.testing.assert_array_equal(
        smooth.observation.curve_kpa, smooth_cycle(subject().observation.curve_kpa[None], 0.025)[0]
    )
    window = late_diastolic(smooth.observation, chain().passive)
    assert smooth.passive.late_diastolic_observed_kpa == pytest.approx(
        smooth.observation.stiffness_kpa[window].mean()
    )


def test_only_volunteers_are_recorded_anew() -> None:
    stranger = replace(subject().observation.context, age_years=33.0)
    with pytest.raises(ArtefactError, match="virtual volunteer"):
        truth_of(stranger)


def test_the_passive_scale_s_error_is_that_of_the_late_diastolic_mean() -> None:
    one, settings = subject(), chain()
    window = late_diastolic(one.observation, settings.passive)
    error = one.observation.stiffness_se_kpa[window]
    of_mean = np.sqrt(np.sum(error**2)) / window.sum()
    passive_part = one.passive.late_diastolic_observed_kpa - one.passive.late_diastolic_active_kpa
    assert passive_scale_error(one.observation, one.passive, settings.passive) == pytest.approx(
        of_mean / passive_part
    )


def test_an_uncertain_passive_scale_spreads_late_diastole_and_leaves_the_median() -> None:
    settings = chain()
    theta = np.repeat(log_centre(settings.prior)[None], 400, axis=0)
    fixed = predictive_curves(subject(), theta, Treatment(), settings, SEED)
    loose = predictive_curves(subject(), theta, Treatment(passive_scale_errors=1.0), settings, SEED)
    late = (GRID > 0.85) & (GRID < 0.95)
    fraction = passive_scale_error(subject().observation, subject().passive, settings.passive)
    passive = subject().passive.stiffness_kpa[np.searchsorted(subject().passive.cycle_phase, 0.9)]
    assert np.ptp(fixed, axis=0).max() == 0.0
    np.testing.assert_allclose(loose[:, late].std(axis=0).mean(), fraction * passive, rtol=0.15)
    np.testing.assert_allclose(np.median(loose[:, late], axis=0), fixed[0, late], rtol=0.01)


def test_the_training_set_of_no_treatment_is_the_study_s() -> None:
    settings = chain()
    pool = reading_pool([case()], features(), settings, SEED)
    clean = case().subject.simulated_features(
        case().simulations.cycle_phase, case().simulations.active_stiffness_kpa, settings.summary
    )
    copies = settings.observation_model.augmentations
    assert pool.z.shape == (12 * copies, clean.shape[1] + 7)
    quiet = [j for j, name in enumerate(pool.components.features) if name not in features().on_features]
    raw = pool.z * pool.standardisation.scale + pool.standardisation.mean
    np.testing.assert_allclose(raw[::copies][:, quiet], clean[:, quiet], rtol=1e-4, atol=1e-3)


def test_the_training_set_of_noise_on_curves_has_as_many_rows_and_noise_on_the_trajectory() -> None:
    settings = chain()
    plain, noisy = (
        reading_pool([case()], each, settings, SEED) for each in (features(), features(curve_noise=True))
    )
    assert noisy.z.shape == plain.z.shape
    np.testing.assert_array_equal(noisy.theta, plain.theta)
    np.testing.assert_array_equal(noisy.draw_index, plain.draw_index)
    copies = settings.observation_model.augmentations
    trajectory = [j for j, name in enumerate(plain.components.names) if name.startswith("trajectory")]
    by_draw = [pool.z.reshape(12, copies, -1)[..., trajectory].std(axis=1) for pool in (plain, noisy)]
    assert by_draw[0].max() == 0.0
    assert (by_draw[1] > 0.0).mean() > 0.99


def test_time_after_the_peak_is_stretched_and_before_it_kept() -> None:
    phase = np.arange(200) / 200
    cycle = 4.0 + 50.0 * np.exp(-0.5 * ((phase - 0.4) / 0.1) ** 2)
    stretched = stretched_after_peak(phase, cycle[None], 0.05)[0]
    np.testing.assert_allclose(stretched[phase <= 0.4], cycle[phase <= 0.4], rtol=1e-9)
    after = (phase > 0.4) & (phase < 0.8)
    exact = 4.0 + 50.0 * np.exp(-0.5 * ((phase - 0.4) / (0.1 * 1.05)) ** 2)
    np.testing.assert_allclose(stretched[after], exact[after], rtol=1e-4)
    assert stretched_after_peak(phase, cycle[None], 0.0) is not None


def test_along_the_own_beat_recordings_have_the_law_of_their_own_stretch() -> None:
    simulations, one, settings = case().simulations, subject(), chain()
    active = (simulations.cycle_phase, simulations.active_stiffness_kpa)
    along = {
        kind: synthetic_cycles(one, simulations, features(recovery_passive=kind), settings)
        for kind in ("reference", "own")
    }
    np.testing.assert_array_equal(along["reference"], total_cycle(active, one.passive, settings.measurement))
    passive = along["own"] - simulations.active_stiffness_kpa
    law = one.passive.scale_kpa * np.exp(settings.passive.exponent_b * (simulations.stretch**2 - 1.0))
    np.testing.assert_allclose(passive, law, rtol=1e-9)
    assert np.abs(along["own"] - along["reference"]).max() > 0.1


def test_synthetic_recordings_share_theta_and_noise_between_readings() -> None:
    settings = chain()
    cases = [case("A"), case("B")]
    theta, raw = synthetic_recordings(cases, features(), settings, SEED)
    again, otherwise = synthetic_recordings(cases, features(recovery_stretch=0.005), settings, SEED)
    assert theta.shape == (settings.recovery.recordings, 3)
    np.testing.assert_array_equal(theta, again)
    moved = np.abs(otherwise - raw).max(axis=0)
    assert 0.0 < moved[SCALAR_NAMES.index("half_relaxation_time_cycle")] < 0.01
    assert moved[SCALAR_NAMES.index("minimum_kpa")] < 0.5


def test_other_weights_give_other_fits_and_the_absolute_error_the_least() -> None:
    settings = chain()
    terms = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    weights = WeightsSettings(
        seeds=(200,),
        weights=tuple(
            CurveLossSettings(mae_weight=m, correlation_weight=c, peak_weight=p) for m, c, p in terms
        ),
        readings=("base",),
    )
    search = CmaesSettings(seeds=(7,), population_size=8, generations=25, sigma0=0.3, loss=weights.weights[0])
    by_curve, by_peak = fits_by_weights(subject(), weights, search, settings.prior, settings.forward_model)
    assert (by_curve.mae_weight, by_peak.peak_weight) == (1.0, 1.0)
    assert by_curve.rmse_kpa < 2.0 < by_peak.rmse_kpa
    assert by_peak.loss < 1e-3


def test_base_must_change_nothing_and_names_must_be_known() -> None:
    plain = parse_section(SECTION, "readings", ReadingsSettings).to_plain()
    assert ReadingsSettings.from_plain(plain)
    wrong: list[tuple[dict[str, Any], str]] = [
        (
            {"readings": plain["readings"] | {"base": {"label": "x", "treatment": {"aligned": True}}}},
            "'base'",
        ),
        ({"acquisition_seeds": ["nothing"]}, "nothing"),
        ({"acquisition_seeds": ["aligned"]}, "treats recordings or curves"),
        ({"cmaes": plain["cmaes"] | {"readings": ["nothing"]}}, "nothing"),
    ]
    for changes, message in wrong:
        with pytest.raises(ValidationError, match=message):
            ReadingsSettings.from_plain(plain | changes)


def test_a_reading_may_not_change_the_simulations() -> None:
    other = Reading(label="x", changes={"forward_model": {"destruction_alpha": 2.0}})
    changed = SMALL.model_copy(update={"readings": {**SMALL.readings, "other": other}})
    with pytest.raises(ConfigError, match="the study's simulations"):
        run_settings(load_study(SHIPPED), changed, "other")


def test_readings_are_of_an_experiment_on_features() -> None:
    changed = SMALL.model_copy(update={"experiment": "calibrated"})
    with pytest.raises(
        ConfigError, match="readings.experiment = 'calibrated' is no experiment of kind features"
    ):
        run_settings(load_study(SHIPPED), changed, "base")


def test_a_changed_value_reaches_the_stages_of_the_reading_that_changes_it() -> None:
    study = load_study(SHIPPED)
    base, robust = (run_settings(study, SMALL, name) for name in ("base", "robust"))
    assert robust["chain"]["summary"] == base["chain"]["summary"] | {"landmarks": "robust"}
    assert not base["changed"] and robust["changed"]
    seeds = seeds_settings(study, SMALL, "robust")
    assert seeds["run"] == robust
    assert seeds["judged"] == judged_settings(study, "paper", SMALL.seeds) | {
        "summary": robust["chain"]["summary"]
    }
    assert cmaes_settings(study, SMALL, "noise_quarter")["treatment"]["noise_factor"] == 0.25


def test_verdicts_are_asked_for_under_the_seeds_of_the_study_over_seeds() -> None:
    others = read_yaml(ROOT / "studies" / "acquisition_seeds" / "config.yaml")
    assert SECTION["seeds"] == others["acquisition_seeds"]["seeds"]


def run(study: StudyCopy, reading: str, numbers: Path) -> pd.DataFrame:
    subjects, results = ("A", "F"), study.results
    settings = run_settings(load_study(SHIPPED), SMALL, reading)
    stage.readings_run(
        pool=results / "paper" / "pool.h5",
        checkpoints=results / "paper" / "checkpoints.pt",
        observations=[results / "cohort" / name / "observation.h5" for name in subjects],
        passives=[results / "cohort" / name / "passive.h5" for name in subjects],
        shards=sorted(results.glob("simulations/paper/*/shard-*.h5")),
        numbers=numbers,
        settings=stage.ReadingStageSettings.from_plain(settings),
        origin=Origin(20260),
    )
    return pd.read_csv(numbers)


SAME_NUMBERS = {
    "rmse_kpa": "rmse_kpa",
    "r2": "r2",
    "coverage_curve": "coverage_noiseless_grid",
    "coverage_observed": "coverage_observed_grid",
}


@pytest.fixture(scope="module")
def base(finished: StudyCopy, tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    return run(finished, "base", tmp_path_factory.mktemp("readings") / "base.csv")


@pytest.mark.slow(minutes=1)
def test_the_base_reading_gives_the_study_s_own_numbers(finished: StudyCopy, base: pd.DataFrame) -> None:
    chosen = base[base["chosen"] == 1].set_index(["quantity", "of"])["value"]
    study = pd.read_csv(finished.results / "tables" / "ppc.csv")
    study = study[study["experiment"] == "paper"].set_index("subject")
    assert study["may_be_read"].any()
    for name, row in study.iterrows():
        assert chosen["supported", name] == row["may_be_read"]
        assert chosen["rmse_prior_kpa", name] == pytest.approx(row["rmse_prior_kpa"], rel=1e-6)
        if row["may_be_read"]:
            for ours, theirs in SAME_NUMBERS.items():
                assert chosen[ours, name] == pytest.approx(row[theirs], rel=1e-6), (name, ours)
    recovery = pd.read_csv(finished.results / "paper" / "recovery.csv")
    for row in recovery[recovery["nominal"] == 0.9].itertuples():
        assert chosen["recovery_coverage", row.parameter] == pytest.approx(row.coverage)
    assert base["epoch"].nunique() > 2  # recovery at every checkpoint


@pytest.mark.slow(minutes=1)
def test_a_trained_reading_repeats_and_differs_from_the_base(
    finished: StudyCopy, base: pd.DataFrame, tmp_path: Path
) -> None:
    first, again = (run(finished, "robust", tmp_path / f"{name}.csv") for name in ("first", "again"))
    pd.testing.assert_frame_equal(first, again)
    z = [frame[frame["quantity"] == "max_abs_z"]["value"].to_numpy() for frame in (first, base)]
    assert not np.allclose(z[0], z[1])
