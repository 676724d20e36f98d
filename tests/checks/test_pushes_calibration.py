"""Free-running recordings of known parameters: made as the model says, each by streams of its own, scored."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import exact_case
import numpy as np
import pytest
from population_case import CONFIG, EXPERIMENT, FRESH, trained
from scipy.stats import kstest
from speed_case import shipped

from swesbi.artefacts import Origin, save
from swesbi.checks.calibration.pushes import (
    KIND,
    InferredPushes,
    PushesStudy,
    by_pushes,
    pushes_dataset,
    read_pushes,
)
from swesbi.posterior.settings import asking

BASE = shipped().speed_experiments["calibrated"]
SIZES = BASE.calibration.recordings.model_copy(update={"network_draws": 99, "effective_draws": 40})
SMALL = asking(exact_case.SETTINGS, 40).model_copy(update={"draws": 400})


def study(pushes: tuple[int, ...] = (3, 20)) -> PushesStudy:
    asked = EXPERIMENT.calibration.free_running.model_copy(update={"pushes": pushes})
    return PushesStudy(FRESH, asked, SIZES, SMALL, BASE.misspecification.rule, seed=11)


@pytest.fixture(scope="module")
def inferred() -> InferredPushes:
    return study().infer(range(2), trained().flow)


def test_recordings_have_the_errors_that_their_model_says() -> None:
    """Residuals at the true phi are standard normal where the errors are known, and wider where declared."""
    made = [study().recorded(number, 30) for number in range(60)]
    known = [
        model.innovations(model.model.predict(phi[None])).z[0]
        for model, phi in made
        if not model.noise_log_sd
    ]
    assert 20 <= len(known) <= 40
    assert kstest(np.concatenate(known), "norm").pvalue > 0.01
    assert all(0.0 <= model.noise_log_sd <= 0.5 for model, _ in made)


def test_a_recording_depends_on_its_own_number_alone() -> None:
    one, phi = study((30,)).recorded(5, 30)
    other, again = study((2, 30)).recorded(5, 30)
    np.testing.assert_array_equal(phi, again)
    np.testing.assert_array_equal(one.model.recording.speed_m_s, other.model.recording.speed_m_s)
    assert one.model.recording.context != study().recorded(5, 3)[0].model.recording.context


def test_parts_are_read_as_one(inferred: InferredPushes, tmp_path: Path) -> None:
    for number in range(2):
        made = Origin(1, "", "0" * 64).provenance(KIND, CONFIG.acquisition)
        save(tmp_path / f"{number}.h5", {"/": pushes_dataset(inferred)}, made)
    read = read_pushes([tmp_path / "0.h5", tmp_path / "1.h5"])
    assert read.pushes.tolist() == [3, 20, 3, 20] * 2
    np.testing.assert_array_equal(read.ranked.truth[:4], inferred.ranked.truth)
    assert read.contexts[:4] == inferred.contexts


def test_coverage_is_told_by_the_number_of_pushes(inferred: InferredPushes) -> None:
    prior = FRESH.model.prior.theta
    table = by_pushes(inferred, prior, BASE.calibration.judgement, 0.05)
    assert set(table["pushes"]) == {"all", "3", "20"}
    assert set(table["n"]) == {2, 4}
    surprised = replace(inferred, residual_p_value=np.array([0.01, 0.5, 0.02, 0.5]))
    flagged = by_pushes(surprised, prior, BASE.calibration.judgement, 0.05).set_index("pushes")
    assert flagged.loc["3", "residuals_flagged"].iloc[0] == 1.0
    assert flagged.loc["20", "residuals_flagged"].iloc[0] == 0.0
