"""The study over epochs: the best epoch is the experiment itself, others follow their own networks."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from rules import STAGES
from study_copy import StudyCopy

from swesbi.artefacts import ArtefactError
from swesbi.checks.epochs import inference_by_epoch
from swesbi.config.read import overlay, read_merged, read_yaml
from swesbi.config.study import load_study
from swesbi.config.view import View
from swesbi.networks.paper.estimator import TrainedEstimator, losses
from swesbi.networks.paper.pool import Pool
from swesbi.networks.training import (
    COVERAGE_GRID,
    COVERAGE_PHASES,
    EPOCHS,
    FRESH_LOSS,
    IN_PRIOR,
    RECOVERY_COVERAGE,
    RELATIVE_SD,
    RMSE,
    TRAINING,
    VALIDATION_LOSS,
)
from swesbi.parameters import THETA_NAMES
from swesbi.posterior.truncated import Posterior
from swesbi.prior import PriorSettings, prior_variance
from swesbi.study.job import run_stage
from swesbi.study.stage import plain_settings

SUBJECTS = ("A", "F")


@pytest.fixture(scope="module")
def table(finished: StudyCopy) -> pd.DataFrame:
    return EPOCHS.read(finished.results / "paper" / "epochs.csv")


def values(table: pd.DataFrame, quantity: str, epoch: int, **where: str) -> pd.Series:
    chosen = (table["quantity"] == quantity) & (table["epoch"] == epoch)
    for column, value in where.items():
        chosen &= table[column] == value
    return table["value"][chosen]


def best_epoch(finished: StudyCopy) -> int:
    return TrainedEstimator.read(finished.results / "paper" / "estimator.h5").epoch


def test_every_checkpoint_has_every_quantity(finished: StudyCopy, table: pd.DataFrame) -> None:
    history = TRAINING.read(finished.results / "paper" / "training.csv").set_index("epoch")
    expected = {1, 3, 6, best_epoch(finished), int(history.index.max())}
    assert set(table["epoch"]) == expected
    for epoch in expected:
        (loss,) = values(table, VALIDATION_LOSS, epoch)
        assert loss == pytest.approx(history["validation_loss"][epoch], rel=1e-6)
        counts = table["quantity"][table["epoch"] == epoch].value_counts()
        assert counts[RECOVERY_COVERAGE] == len(THETA_NAMES)
        assert counts[RELATIVE_SD] == len(THETA_NAMES) * len(SUBJECTS)
        assert all(counts[each] == len(SUBJECTS) for each in (IN_PRIOR, COVERAGE_GRID, COVERAGE_PHASES, RMSE))


def test_best_epoch_agrees_with_the_experiment(finished: StudyCopy, table: pd.DataFrame) -> None:
    best, paper = best_epoch(finished), finished.results / "paper"
    assert set(table["epoch"][table["best"] == 1]) == {best}
    recovery = pd.read_csv(paper / "recovery.csv").query("nominal == 0.9").set_index("parameter")
    for name in THETA_NAMES:
        (coverage,) = values(table, RECOVERY_COVERAGE, best, parameter=name)
        assert coverage == pytest.approx(recovery["coverage"][name], rel=1e-6)
    scores = pd.read_csv(finished.results / "tables" / "ppc.csv")
    scores = scores[scores["experiment"] == "paper"].set_index("subject")
    assert scores["may_be_read"].any()
    for subject in SUBJECTS:
        for quantity in (RMSE, COVERAGE_GRID, COVERAGE_PHASES):
            (value,) = values(table, quantity, best, subject=subject)
            np.testing.assert_allclose(value, scores[quantity][subject], rtol=1e-6, err_msg=subject)


def test_width_is_that_of_the_posterior_relative_to_the_prior(
    finished: StudyCopy, table: pd.DataFrame
) -> None:
    prior = PriorSettings.from_plain(settings_of(finished)["prior"])
    best = best_epoch(finished)
    compared = 0
    for subject in SUBJECTS:
        theta = Posterior.read(finished.results / "paper" / "subjects" / subject / "posterior.h5").theta
        for j, name in enumerate(THETA_NAMES):
            (ratio,) = values(table, RELATIVE_SD, best, subject=subject, parameter=name)
            if np.isfinite(ratio):
                # the posterior keeps the first 500 of the draws that the width is taken from
                assert ratio == pytest.approx(theta[:, j].std() / np.sqrt(prior_variance(prior)[j]), rel=0.15)
                compared += 1
    assert compared >= len(THETA_NAMES)


def test_loss_of_unseen_parameters_is_that_of_the_density(finished: StudyCopy, table: pd.DataFrame) -> None:
    """The mean lies near the validation loss, not at it, as that of rows of the pool does."""
    pool = Pool.read(finished.results / "paper" / "pool.h5")
    estimator = TrainedEstimator.read(finished.results / "paper" / "estimator.h5")
    near = losses(estimator, pool.theta[:400], pool.z[:400])
    assert near.mean() == pytest.approx(estimator.validation_loss, abs=1.5)
    fresh = table[table["quantity"] == FRESH_LOSS]
    assert ((fresh["ci_low"] < fresh["value"]) & (fresh["value"] < fresh["ci_high"])).all()
    for epoch, value in zip(fresh["epoch"], fresh["value"], strict=True):
        (validation,) = values(table, VALIDATION_LOSS, epoch)
        assert value != validation
        assert value == pytest.approx(validation, abs=1.5)


def settings_of(study: StudyCopy) -> dict[str, Any]:
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(study.folder)
        config = overlay(read_merged(study.folder / "config.yaml"), read_yaml(study.folder / "smoke.yaml"))
        settings = plain_settings(STAGES["epochs"], View(load_study(config), {"experiment": "paper"}))
        return settings | {"seed": config["seed"]}


def run(study: StudyCopy, path: Path, settings: dict[str, Any], subjects: tuple[str, ...]) -> None:
    paper, cohort = study.results / "paper", study.results / "cohort"
    inputs = {
        "pool": [paper / "pool.h5"],
        "checkpoints": [paper / "checkpoints.h5"],
        "observations": [cohort / name / "observation.h5" for name in SUBJECTS],
        "passives": [cohort / name / "passive.h5" for name in SUBJECTS],
        "verdicts": [paper / "subjects" / name / "verdict.json" for name in subjects],
    }
    run_stage(inference_by_epoch, inputs, {"epochs": [path]}, settings | {"subject": "", "code": "0"})


def test_too_few_draws_leave_numbers_empty(finished: StudyCopy, tmp_path: Path) -> None:
    changed = settings_of(finished)
    changed["support"] |= {"min_in_prior_draws": 3000}
    changed["recovery"] |= {"min_in_prior_draws": 300}
    changed["prior"]["k0_kpa"] |= {"low": 44.9, "high": 45.1}
    run(finished, tmp_path / "epochs.csv", changed, SUBJECTS)
    table = EPOCHS.read(tmp_path / "epochs.csv")
    for quantity in (RECOVERY_COVERAGE, RELATIVE_SD, RMSE):
        assert table["value"][table["quantity"] == quantity].isna().all(), quantity
    assert table["value"][table["quantity"] == IN_PRIOR].between(0.0, 0.5).all()


def test_a_missing_verdict_is_named(finished: StudyCopy, tmp_path: Path) -> None:
    with pytest.raises(ArtefactError, match="verdicts: no file of F is given"):
        run(finished, tmp_path / "epochs.csv", settings_of(finished), ("A",))
