from __future__ import annotations

from dataclasses import replace

import comparison_case
import numpy as np
import pytest
import speed_case
from scipy.stats import kstest, multivariate_normal

from swesbi.measurement.likelihood import draw_speeds, log_likelihood, log_speed_sd, residuals
from swesbi.measurement.shared_error import draw_shared, innovations, normal_log_density
from swesbi.measurement.speeds import PredictedSpeeds, SpeedRecording, measured_speeds
from swesbi.recording.noise.errors import MeanErrors, mean_errors

ROWS, DATA = 6, 8
PHI = speed_case.PHI


def case(factors: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distances and own sd of rows of data, and W with a datum that shares nothing."""
    rng = np.random.default_rng(seed)
    shared = rng.normal(0.0, 1.0, (DATA, factors))
    shared[3] = 0.0
    return rng.normal(0.0, 2.0, (ROWS, DATA)), rng.uniform(0.3, 1.5, (ROWS, DATA)), shared


def covariances(sd: np.ndarray, shared: np.ndarray) -> list[np.ndarray]:
    return [np.diag(row**2) + shared @ shared.T for row in sd]


@pytest.mark.parametrize("factors", [1, 3, 5])
def test_density_and_chi_squared_are_those_of_the_multivariate_normal(factors: int) -> None:
    distance, sd, shared = case(factors)
    found = innovations(distance, sd, shared)
    for row, covariance in enumerate(covariances(sd, shared)):
        d = distance[row]
        assert found.log_density[row] == pytest.approx(multivariate_normal(cov=covariance).logpdf(d))
        assert found.chi_squared[row] == pytest.approx(d @ np.linalg.solve(covariance, d))
        factor = np.linalg.cholesky(covariance)
        np.testing.assert_allclose(found.z[row], np.linalg.solve(factor, d))
        np.testing.assert_allclose(found.sd[row], np.diag(factor))


def test_a_shared_error_far_above_the_own_ones_loses_no_digits() -> None:
    distance, sd, shared = case(2)
    found = innovations(distance, 1e-3 * sd, shared)
    for row, covariance in enumerate(covariances(1e-3 * sd, shared)):
        expected = multivariate_normal(cov=covariance).logpdf(distance[row])
        assert found.log_density[row] == pytest.approx(expected, rel=1e-8)


def test_where_nothing_is_shared_all_is_as_it_is_for_each_datum_to_the_bit() -> None:
    distance, sd, shared = case(0)
    found = innovations(distance, sd, shared)
    np.testing.assert_array_equal(found.z, distance / sd)
    np.testing.assert_array_equal(found.sd, sd)
    alone = normal_log_density(distance / sd, np.log(sd)).sum(axis=1)
    np.testing.assert_array_equal(found.log_density, alone)
    nearly = innovations(distance, sd, np.zeros((DATA, 2)))
    np.testing.assert_allclose(nearly.log_density, alone)
    rng, untouched = np.random.default_rng(1), np.random.default_rng(1)
    np.testing.assert_array_equal(draw_shared(shared, ROWS, rng), np.zeros((ROWS, DATA)))
    assert rng.random() == untouched.random()


def test_a_failed_row_fails_alone() -> None:
    distance, sd, shared = case(3)
    broken = distance.copy()
    broken[2] = np.nan
    found, whole = innovations(broken, sd, shared), innovations(distance, sd, shared)
    kept = np.arange(ROWS) != 2
    np.testing.assert_array_equal(found.log_density[kept], whole.log_density[kept])
    assert np.isnan(found.log_density[2])


def test_draws_have_the_covariance_that_they_are_said_to_have() -> None:
    _, _, shared = case(3)
    found = np.cov(draw_shared(shared, 100_000, np.random.default_rng(2)), rowvar=False)
    expected = shared @ shared.T
    np.testing.assert_allclose(found, expected, atol=0.02 * np.diag(expected).max())
    each = np.stack([shared, 2.0 * shared])
    rng, same = np.random.default_rng(3), np.random.default_rng(3)
    of_each, of_one = draw_shared(each, 2, rng), draw_shared(shared, 2, same)
    np.testing.assert_allclose(of_each, of_one * np.array([[1.0], [2.0]]))


def test_the_likelihood_of_a_recording_of_sweeps_is_the_multivariate_normal_density() -> None:
    model = speed_case.model_of_sweeps()
    phi = np.vstack([PHI, PHI * [1.1, 0.9, 1.0, 1.05]])
    predicted, discrepancy = model.predict(phi), model.settings.discrepancy
    sd = log_speed_sd(predicted, model.recording.relative_se, discrepancy)
    covariance = covariances(sd, model.recording.shared)
    distance = np.log(model.recording.speed_m_s) - predicted.log_speed
    expected = [multivariate_normal(cov=c).logpdf(d) for c, d in zip(covariance, distance, strict=True)]
    np.testing.assert_allclose(model.log_likelihood(phi), expected)
    failed = PredictedSpeeds(np.full((1, 20), np.nan), np.full((1, 20), np.nan))
    assert log_likelihood(failed, model.recording, discrepancy)[0] == -np.inf


def test_residuals_of_recordings_of_sweeps_are_independent_standard_normals() -> None:
    model, count = speed_case.model_of_sweeps(), 4000
    predicted, discrepancy = model.predict(PHI[None]), model.settings.discrepancy
    many = predicted.rows(np.zeros(count, dtype=np.int64))
    speeds = draw_speeds(many, model.recording.errors, discrepancy, np.random.default_rng(4))

    def of(recording: SpeedRecording) -> np.ndarray:
        rows = (replace(recording, speed_m_s=row) for row in speeds)
        return np.concatenate([residuals(predicted, row, discrepancy) for row in rows])

    z, apart = of(model.recording), ~np.eye(20, dtype=bool)
    assert kstest(z.ravel(), "norm").pvalue > 0.01
    assert np.abs(np.corrcoef(z, rowvar=False)[apart]).max() < 5.0 / np.sqrt(count)
    ignoring = of(_ignoring(model.recording))
    assert np.corrcoef(ignoring, rowvar=False)[apart].mean() > 0.2  # so the test sees what is ignored


def test_what_a_recording_shares_follows_from_which_phases_each_sweep_has() -> None:
    observed = comparison_case.observation("A")
    counts = observed.samples_by_repeat.copy()
    counts[2, 0] = 0
    observed = replace(observed, samples_by_repeat=counts)
    found = measured_speeds(observed, speed_case.SWEEPS)
    expected = mean_errors(counts[observed.measured], speed_case.SWEEPS)
    np.testing.assert_array_equal(found.relative_se, expected.own)
    np.testing.assert_array_equal(found.shared, expected.shared)
    assert found.shared.shape == (19, 3) and found.shared[2, 0] == 0.0 < found.shared[2, 1]
    separate = measured_speeds(observed)
    assert separate.shared.shape == (19, 0)
    np.testing.assert_array_equal(separate.errors.total, separate.relative_se)


def _ignoring(recording: SpeedRecording) -> SpeedRecording:
    """Return the recording as a likelihood sees it that takes all of its errors for independent."""
    alone = MeanErrors.separate(recording.errors.total)
    return replace(recording, relative_se=alone.own, shared=alone.shared)
