"""The stages from the posterior to figures and tables, on recordings made with the real simulator."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from evaluation_study import CONFIG, PAPER, make_model, run_cmaes, run_predictive, write_study
from rules import PLACES

from swesbi.artefacts.files import hdf5_provenance
from swesbi.artefacts.typed import Place
from swesbi.checks.cmaes import CmaesFit, simulated_curves
from swesbi.checks.predictive import PredictiveCheck
from swesbi.heart.model import activation_duration_s
from swesbi.measurement.settings import SCALAR_NAMES
from swesbi.measurement.summary import summarise
from swesbi.posterior.truncated import Posterior
from swesbi.report.study_tables import StudyTables, study_tables
from swesbi.verdict.verdict import Verdict

TITLE = "virtual volunteers"
LIGHT_RULES = (
    "predictive", "subject_figures", "cohort_figures", "tables", "workflow_figure", "paper_comparison",
    "predictive_speeds", "exact_subject_figures", "exact_figures", "truth", "report", "pressures_table",
    "pressures_figure", "cohort_posterior_figure", "training_figure", "pool", "posterior",
)  # fmt: skip

# what a subject has without a posterior
OF_THE_PRIOR = [
    "rmse_prior_kpa",
    "rmse_cmaes_kpa",
    "coverage_prior_band_grid",
    "coverage_prior_envelope_grid",
]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folders = write_study(tmp_path_factory.mktemp("results"))
    for folder in folders.values():
        run_predictive(folder, folder / "predictive.h5")
        run_cmaes(folder, folder / "cmaes.h5")
    return folders


@pytest.fixture(scope="module")
def tables(study: dict[str, Path]) -> StudyTables:
    by_place = {Place("paper", subject): folder for subject, folder in study.items()}
    return study_tables(
        {at: PredictiveCheck.read(path / "predictive.h5") for at, path in by_place.items()},
        {at: Posterior.read(path / "posterior.h5") for at, path in by_place.items()},
        {at: Verdict.read(path / "verdict.json") for at, path in by_place.items()},
        {subject: CmaesFit.read(folder / "cmaes.h5") for subject, folder in study.items()},
        cohort_title="virtual volunteers",
    )


def test_posterior_about_the_truth_predicts_the_recording_within_its_noise(study: dict[str, Path]) -> None:
    path = study["A"] / "predictive.h5"
    check = PredictiveCheck.read(path)
    assert check.may_be_read and hdf5_provenance(path).subject == "A"
    assert check.posterior.scores.rmse_kpa < 0.3 * check.prior.scores.rmse_kpa
    assert check.posterior.scores.r2 > 0.97
    assert check.posterior.coverage_recording_noise > max(0.6, check.posterior.phase_scores.coverage)
    assert check.posterior.features.inside.sum() >= 2


def test_excluded_subject_keeps_its_prior_prediction_and_has_no_posterior(study: dict[str, Path]) -> None:
    check = PredictiveCheck.read(study["E"] / "predictive.h5")
    assert not check.may_be_read
    assert check.posterior.draws.curve_kpa.shape == (0, 100)
    assert np.isnan(check.posterior.scores.rmse_kpa) and np.isnan(check.posterior.curve.median).all()
    assert not check.posterior.features.inside.any()
    assert check.prior.scores.rmse_kpa > 0.0


def test_predictive_curves_pass_the_operator_of_the_observed_one(study: dict[str, Path]) -> None:
    check, model = PredictiveCheck.read(study["A"] / "predictive.h5"), make_model("A")
    draws = check.posterior.draws
    simulated = simulated_curves(draws.theta[:3], model, CONFIG.forward_model)
    np.testing.assert_allclose(draws.curve_kpa[:3], simulated, rtol=1e-9)
    observed = summarise(model.observation.curve_kpa[None], PAPER.summary)[0]
    assert check.target.features[0] == observed[SCALAR_NAMES.index("maximum_kpa")]
    duration_s = activation_duration_s(model.observation.context.period_s, CONFIG.forward_model)
    expected = draws.theta[:, 0] * (1.0 - np.exp(-draws.theta[:, 1] * duration_s))
    np.testing.assert_allclose(draws.isometric_stiffness_kpa, expected, rtol=1e-12)


def test_ppc_table_compares_posterior_with_prior_and_is_blank_without_one(tables: StudyTables) -> None:
    table = tables.ppc_csv.set_index("subject")
    assert table["may_be_read"].to_dict() == {"A": True, "E": False}
    supported, excluded = table.loc["A"], table.loc["E"]
    reduction = 100.0 * (1.0 - supported["rmse_kpa"] / supported["rmse_prior_kpa"])
    assert supported["rmse_reduction_percent"] == pytest.approx(reduction, rel=1e-6)
    assert list(excluded.dropna().index) == ["experiment", "may_be_read", *OF_THE_PRIOR]
    assert supported["coverage_noiseless_grid"] == supported["coverage_grid"]
    assert supported["coverage_observed_grid"] > supported["coverage_noiseless_grid"]
    assert (table["coverage_prior_band_grid"] <= table["coverage_prior_envelope_grid"]).all()


def test_features_table(tables: StudyTables) -> None:
    table = tables.features_csv
    supported, excluded = table[table["may_be_read"]], table[~table["may_be_read"]]
    inside = (supported["observed"] >= supported["pi_low"]) & (supported["observed"] <= supported["pi_high"])
    assert (supported["inside"].astype(str) == inside.astype(str)).all()
    assert excluded["inside"].isna().all() and len(excluded) == len(supported)
    assert supported["noise_sd"].tolist() == [1.0, 0.5, 0.5, 5.0, 0.03]


def test_posterior_table(tables: StudyTables) -> None:
    table = tables.posterior_csv.set_index(["subject", "parameter"])
    k0 = table.loc[("A", "k0_kpa")]
    assert k0["ci_low"] < k0["median"] < k0["ci_high"] and k0["correlation_k_atp_per_s"] < -0.7
    assert table.loc[("E", "k_atp_per_s"), "cmaes"] <= 30.0
    assert table.loc[("E", "k_atp_per_s"), "unfiltered_median"] == pytest.approx(38.0, rel=0.01)
    assert table.loc["E"]["median"].isna().all() and table.loc["A"]["median"].notna().all()
    derived, context = table.loc["A"], make_model("A").observation.context
    volumes = derived.loc[["end_diastolic_volume_ml", "end_systolic_volume_ml"]]
    assert volumes["measured"].tolist() == [context.lvedv_ml, context.lvesv_ml]
    for column, tolerance in (("median", 0.005), ("measured", 1e-6)):
        fraction = 1.0 - volumes[column].iloc[1] / volumes[column].iloc[0]
        assert derived.loc["ejection_fraction", column] == pytest.approx(fraction, abs=tolerance)
    assert derived.loc["isometric_stiffness_kpa", "median"] < derived.loc["k0_kpa", "median"]


def test_readers_and_figures_leave_torch_and_pyplot_alone() -> None:
    modules = sorted({PLACES[rule][0] for rule in LIGHT_RULES} | {"swesbi.population.recordings"})
    load = f"from importlib import import_module; [import_module(name) for name in {modules}]"
    code = f"{load}; import sys; print([m for m in ('torch', 'matplotlib.pyplot') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
