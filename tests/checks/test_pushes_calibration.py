"""Free-running recordings of known parameters: made as the model says, each by streams of its own, scored."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import exact_case
import numpy as np
import pytest
from population_case import EXPERIMENT, FRESH, trained
from scipy.stats import kstest
from speed_case import shipped

from swesbi.artefacts import Provenance
from swesbi.artefacts.typed import read_as
from swesbi.base.arrays import rows_of
from swesbi.checks.calibration.dataset import PushesCalibration
from swesbi.checks.calibration.known import PUSHES_STREAM, pushes_on_fresh
from swesbi.checks.calibration.scores import scores_on_pushes
from swesbi.population.recordings import record_pushes
from swesbi.posterior.settings import asking
from swesbi.verdict.null_recordings import NullRecordings

BASE = shipped().speed_experiments["calibrated"]
SIZES = BASE.calibration.recordings.model_copy(update={"network_draws": 99, "effective_draws": 40})
SMALL = asking(exact_case.SETTINGS, 40).model_copy(update={"draws": 400})


@pytest.fixture(scope="module")
def inferred() -> PushesCalibration:
    asked = EXPERIMENT.calibration.free_running.model_copy(update={"pushes": (3, 20)})
    return pushes_on_fresh(
        trained().estimator,
        pushes_numbers=(0, 2),
        fresh=FRESH,
        free_running=asked,
        recordings=SIZES,
        exact=SMALL,
        seed=11,
    )


def test_recordings_have_the_errors_that_their_model_says() -> None:
    """Residuals at the true phi are standard normal where the errors are known, and wider where declared."""
    made = [record_pushes(number, (30, 30), FRESH, 11, PUSHES_STREAM, 30) for number in range(60)]
    known = [model.standardised(phi[None])[0] for model, phi in made if not model.recording.errors_log_sd]
    assert 20 <= len(known) <= 40
    assert kstest(np.concatenate(known), "norm").pvalue > 0.01
    assert all(0.0 <= model.recording.errors_log_sd <= 0.5 for model, _ in made)


def test_parts_are_read_as_one(inferred: PushesCalibration, tmp_path: Path) -> None:
    paths = [tmp_path / "0.h5", tmp_path / "1.h5"]
    for path in paths:
        inferred.write(path, Provenance(""))
    read, made = read_as(PushesCalibration, paths, "parts").pushes, inferred.pushes
    assert read.inferred.misfits.points.tolist() == [3, 20, 3, 20] * 2
    np.testing.assert_array_equal(read.inferred.ranked.truth[4:], made.inferred.ranked.truth)
    assert read.contexts == 2 * made.contexts


def test_coverage_is_told_by_the_number_of_pushes(inferred: PushesCalibration) -> None:
    rng, rule = np.random.default_rng(1), BASE.misspecification.rule
    made = inferred.pushes.inferred
    null = replace(rows_of(made.misfits, np.zeros(200, dtype=np.int64)), residuals_p=rng.beta(3.0, 3.0, 200))
    quiet = np.zeros_like(made.misfits.bound_ratio)
    both = replace(null, errors_log_sd=np.where(np.arange(200) < 100, 0.0, 0.3))
    misfits = replace(made.misfits, residuals_p=np.array([1e-9, 0.5, 1e-9, 0.5]), bound_ratio=quiet)
    surprised = replace(inferred.pushes, inferred=replace(made, misfits=misfits))
    table = scores_on_pushes(
        PushesCalibration(surprised),
        NullRecordings((), both, both),
        judgement=BASE.calibration.judgement,
        rule=rule,
    ).table.set_index("pushes")
    assert set(table.index) == {"all", "3", "20"}
    assert set(table["n"]) == {2, 4}
    assert len(table) == 3 * 3 * len(BASE.calibration.judgement.nominal_levels)
    assert table["false_alarms"].groupby(level=0).first().to_dict() == {"all": 0.5, "3": 1.0, "20": 0.0}
