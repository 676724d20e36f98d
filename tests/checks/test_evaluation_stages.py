"""The stages from the posterior to figures and tables, on recordings made with the real simulator."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from evaluation_study import (
    EXPERIMENT,
    FORWARD_MODEL,
    PRIOR,
    SUMMARY,
    TRUE_THETA,
    Files,
    make_model,
    run_cmaes,
    run_predictive,
    write_study,
)
from rules import PLACES

from swesbi.artefacts import ArtefactError, Provenance
from swesbi.artefacts.files import hdf5_provenance
from swesbi.artefacts.typed import ByPlace, Place, write_as
from swesbi.checks.cmaes import CmaesFit
from swesbi.checks.predictive import PredictiveCheck
from swesbi.checks.simulated import simulated_curves
from swesbi.heart.model import activation_duration_s
from swesbi.measurement.settings import SCALAR_NAMES
from swesbi.measurement.summary import summarise
from swesbi.parameters import THETA_NAMES
from swesbi.posterior.truncated import Posterior
from swesbi.report.figures.style import Drawing
from swesbi.report.figures.subjects import cohort_figures, subject_figures
from swesbi.report.study_tables import StudyTables, study_tables
from swesbi.verdict.verdict import Verdict

TITLE = "virtual volunteers"
LIGHT_RULES = (
    "predictive", "subject_figures", "cohort_figures", "tables", "workflow_figure", "paper_comparison",
    "predictive_speeds", "exact_subject_figures", "exact_figures", "truth", "report", "pressures_table",
    "pressures_figure", "cohort_posterior_figure", "training_figure",
)  # fmt: skip

PPC_COLUMNS = (
    "experiment", "subject", "may_be_read", "rmse_prior_kpa", "rmse_kpa", "rmse_reduction_percent", "nrmse",
    "r2", "post_peak_rmse_kpa", "coverage_grid", "coverage_phases", "rmse_cmaes_kpa",
    "coverage_noiseless_grid", "coverage_noiseless_phases", "coverage_observed_grid",
    "coverage_observed_phases", "coverage_prior_band_grid", "coverage_prior_envelope_grid",
)  # fmt: skip


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Files]:
    files = write_study(tmp_path_factory.mktemp("results"))
    for subject in files.values():
        run_predictive(subject, subject.folder / "predictive.h5")
        run_cmaes(subject, subject.cmaes)
    return files


def cohort_inputs(study: dict[str, Files]) -> dict[str, dict[Any, Any]]:
    by_place = {Place(EXPERIMENT, name): files.folder for name, files in study.items()}
    return {
        "predictives": {at: PredictiveCheck.read(path / "predictive.h5") for at, path in by_place.items()},
        "posteriors": {at: Posterior.read(path / "posterior.h5") for at, path in by_place.items()},
        "verdicts": {at: Verdict.read(path / "verdict.json") for at, path in by_place.items()},
        "cmaes": {name: CmaesFit.read(files.cmaes) for name, files in study.items()},
    }


@pytest.fixture(scope="module")
def tables(study: dict[str, Files]) -> StudyTables:
    return study_tables(**cohort_inputs(study), cohort_title=TITLE)


def test_posterior_about_the_truth_predicts_the_recording_within_its_noise(study: dict[str, Files]) -> None:
    path = study["A"].folder / "predictive.h5"
    check = PredictiveCheck.read(path)
    assert check.may_be_read and hdf5_provenance(path).subject == "A"
    assert check.posterior.scores.rmse_kpa < 0.3 * check.prior.scores.rmse_kpa
    assert check.posterior.scores.r2 > 0.97
    assert check.posterior.coverage_recording_noise > max(0.6, check.posterior.phase_scores.coverage)
    assert check.posterior.draws.curve_kpa.shape == (40, 100)
    assert check.posterior.features.inside.sum() >= 2


def test_excluded_subject_keeps_its_prior_prediction_and_has_no_posterior(study: dict[str, Files]) -> None:
    check = PredictiveCheck.read(study["E"].folder / "predictive.h5")
    assert not check.may_be_read
    assert check.posterior.draws.curve_kpa.shape == (0, 100)
    assert np.isnan(check.posterior.scores.rmse_kpa) and np.isnan(check.posterior.curve.median).all()
    assert not check.posterior.features.inside.any()
    assert check.prior.scores.rmse_kpa > 0.0


def test_predictive_curves_pass_the_operator_of_the_observed_one(study: dict[str, Files]) -> None:
    check = PredictiveCheck.read(study["A"].folder / "predictive.h5")
    model = make_model("A")
    simulated = simulated_curves(check.posterior.draws.theta[:3], model, FORWARD_MODEL)
    np.testing.assert_allclose(check.posterior.draws.curve_kpa[:3], simulated, rtol=1e-9)
    observed = summarise(model.observation.curve_kpa[None], SUMMARY)[0]
    assert check.target.features[0] == observed[SCALAR_NAMES.index("maximum_kpa")]


def test_derived_quantities_are_physiological(study: dict[str, Files]) -> None:
    draws = PredictiveCheck.read(study["A"].folder / "predictive.h5").posterior.draws
    assert np.all((draws.ejection_fraction > 0.4) & (draws.ejection_fraction < 0.8))
    duration_s = activation_duration_s(make_model("A").observation.context.period_s, FORWARD_MODEL)
    expected = draws.theta[:, 0] * (1.0 - np.exp(-draws.theta[:, 1] * duration_s))
    np.testing.assert_allclose(draws.isometric_stiffness_kpa, expected, rtol=1e-12)


def test_artefacts_open_with_h5py_and_xarray_and_have_units(study: dict[str, Files]) -> None:
    for path in (study["E"].folder / "predictive.h5", study["A"].cmaes):
        assert set(_without_units(path)) <= {"parameter", "feature", "stop"}
        with xr.open_dataset(path, engine="h5netcdf") as dataset:
            assert dataset.attrs["kind"] in ("predictive", "cmaes")


def _without_units(path: Path) -> list[str]:
    """Names of the datasets without units, dimensions that have no values of their own left out."""
    names: list[str] = []

    def visit(name: str, item: h5py.Dataset | h5py.Group) -> None:
        placeholder = b"not a netCDF variable" in bytes(item.attrs.get("NAME", b""))
        if isinstance(item, h5py.Dataset) and not placeholder and "units" not in item.attrs:
            names.append(name.split("/")[-1])

    with h5py.File(path) as file:
        file.visititems(visit)
    return names


def test_same_inputs_give_the_same_bytes(study: dict[str, Files], tmp_path: Path) -> None:
    for subject in study.values():
        run_predictive(subject, tmp_path / "predictive.h5")
        run_cmaes(subject, tmp_path / "cmaes.h5")
        assert (tmp_path / "predictive.h5").read_bytes() == (subject.folder / "predictive.h5").read_bytes()
        assert (tmp_path / "cmaes.h5").read_bytes() == subject.cmaes.read_bytes()


def test_cmaes_history_is_complete_and_within_the_bounds(study: dict[str, Files]) -> None:
    fit = CmaesFit.read(study["E"].cmaes)
    assert fit.seed.tolist() == [200, 201]
    assert fit.evaluations[:, -1].tolist() == (8 * fit.generations).tolist()
    for run, length in enumerate(fit.generations):
        assert np.all(np.diff(fit.best_loss[run, :length]) <= 0.0)
        assert np.isfinite(fit.best_theta[run, :length]).all()
    assert fit.loss == fit.run_loss.min() and fit.theta[1] <= PRIOR.k_atp_per_s.high


@pytest.mark.slow
def test_figures_of_one_subject(study: dict[str, Files]) -> None:
    for files in study.values():
        drawn = subject_figures(
            PredictiveCheck.read(files.folder / "predictive.h5"),
            Posterior.read(files.folder / "posterior.h5"),
            Verdict.read(files.folder / "verdict.json"),
            CmaesFit.read(files.cmaes),
            subject=files.subject,
            cohort_title=TITLE,
            prior=PRIOR,
        )
        assert all(figure.axes for figure in drawn)


@pytest.mark.slow
def test_cohort_figures_in_both_formats(study: dict[str, Files], tmp_path: Path) -> None:
    drawn = cohort_figures(**cohort_inputs(study), cohort_title=TITLE, prior=PRIOR)
    for name, figure in zip(drawn._fields, drawn, strict=True):
        paths = [tmp_path / f"{name}.{ending}" for ending in ("pdf", "png")]
        write_as(Drawing, figure, paths, Provenance(""))
        assert all(path.stat().st_size > 10_000 for path in paths)


def test_a_subject_whose_posterior_is_missing_is_named(study: dict[str, Files]) -> None:
    given = cohort_inputs(study) | {"posteriors": ByPlace("posteriors", (), Posterior.joined)}
    with pytest.raises(ArtefactError, match="posteriors: no file of subject A in experiment 'paper'"):
        study_tables(**given, cohort_title=TITLE)


def test_ppc_table_has_the_agreed_columns_and_blanks(tables: StudyTables) -> None:
    table = tables.ppc_csv
    assert tuple(table.columns) == PPC_COLUMNS
    assert table["subject"].tolist() == list(TRUE_THETA) and set(table["experiment"]) == {EXPERIMENT}
    assert table["may_be_read"].tolist() == [True, False]
    supported, excluded = table.iloc[0], table.iloc[1]
    reduction = 100.0 * (1.0 - supported["rmse_kpa"] / supported["rmse_prior_kpa"])
    assert supported["rmse_reduction_percent"] == pytest.approx(reduction, rel=1e-6)
    blanks = [name for name in PPC_COLUMNS if pd.isna(excluded[name])]
    assert blanks == [*PPC_COLUMNS[4:11], *PPC_COLUMNS[12:16]]
    assert supported["coverage_noiseless_grid"] == supported["coverage_grid"]
    assert supported["coverage_observed_grid"] > supported["coverage_noiseless_grid"]
    ceiling = table[["coverage_prior_band_grid", "coverage_prior_envelope_grid"]]
    assert (ceiling.iloc[:, 0] <= ceiling.iloc[:, 1]).all() and (ceiling <= 1.0).all(axis=None)


def test_features_table(tables: StudyTables) -> None:
    table = tables.features_csv
    predicted = ["prior_median", "prior_pi_low", "prior_pi_high", "median", "pi_low", "pi_high", "inside"]
    assert list(table.columns) == [*PPC_COLUMNS[:3], "feature", "observed", "noise_sd", *predicted]
    assert table.groupby("subject").size().tolist() == [5, 5]
    supported = table[table["may_be_read"]]
    inside = (supported["observed"] >= supported["pi_low"]) & (supported["observed"] <= supported["pi_high"])
    assert (supported["inside"].astype(str) == inside.astype(str)).all()
    assert table[~table["may_be_read"]]["inside"].isna().all()
    assert supported["noise_sd"].tolist() == [1.0, 0.5, 0.5, 5.0, 0.03]


def test_posterior_table(tables: StudyTables) -> None:
    table = tables.posterior_csv
    answer = ("parameter", "unit", "median", "ci_low", "ci_high", "measured")
    correlations = (f"correlation_{name}" for name in THETA_NAMES)
    assert tuple(table) == (*PPC_COLUMNS[:3], *answer, *correlations, "unfiltered_median", "cmaes")
    table = table.set_index(["subject", "parameter"])
    k0 = table.loc[("A", "k0_kpa")]
    assert k0["ci_low"] < k0["median"] < k0["ci_high"] and k0["correlation_k_atp_per_s"] < -0.7
    assert table.loc[("E", "k_atp_per_s"), "unfiltered_median"] == pytest.approx(38.0, rel=0.01)
    assert table.loc["E"]["median"].isna().all() and table.loc["A"]["median"].notna().all()
    derived = table.loc["A"]
    volumes = derived.loc[["end_diastolic_volume_ml", "end_systolic_volume_ml"]]
    context = make_model("A").observation.context
    assert volumes["measured"].tolist() == [context.lvedv_ml, context.lvesv_ml]
    fraction = 1.0 - volumes["median"].iloc[1] / volumes["median"].iloc[0]
    assert derived.loc["ejection_fraction", "median"] == pytest.approx(fraction, abs=0.005)
    measured = 1.0 - context.lvesv_ml / context.lvedv_ml
    assert derived.loc["ejection_fraction", "measured"] == pytest.approx(measured, rel=1e-6)
    assert derived.loc["isometric_stiffness_kpa", "median"] < derived.loc["k0_kpa", "median"]


def test_readers_and_figures_leave_torch_and_pyplot_alone() -> None:
    modules = sorted({PLACES[rule][0] for rule in LIGHT_RULES})
    load = f"from importlib import import_module; [import_module(name) for name in {modules}]"
    code = f"{load}; import sys; print([m for m in ('torch', 'matplotlib.pyplot') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
