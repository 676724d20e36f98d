from functools import cache

import numpy as np
import pandas as pd
import pytest
from inference_case import PAPER_PRIOR
from scipy.stats import beta

from swesbi.checks.calibration.table import coverage
from swesbi.checks.recovery import recover
from swesbi.checks.settings import RecoverySettings
from swesbi.parameters import THETA_NAMES
from swesbi.prior import prior_variance, quantile

RECORDINGS, DRAWS = 400, 1500
LEVELS = (0.5, 0.8, 0.9, 0.95)
SETTINGS = RecoverySettings(
    recordings=RECORDINGS,
    candidate_draws=DRAWS,
    min_in_prior_draws=100,
    nominal_levels=LEVELS,
    confidence=0.95,
)
MEASUREMENT_SD = np.array([4.0, 0.5, 3.0])


@cache
def exact_posteriors() -> tuple[np.ndarray, np.ndarray]:
    """Truths from the prior, one Gaussian measurement each, exact posterior draws by weighting the prior."""
    rng = np.random.default_rng(5)
    truth = quantile(rng.random((RECORDINGS, 3)), PAPER_PRIOR)
    measured = truth + MEASUREMENT_SD * rng.standard_normal(truth.shape)
    particles = quantile(rng.random((20_000, 3)), PAPER_PRIOR)
    draws = np.empty((RECORDINGS, DRAWS, 3))
    for i in range(RECORDINGS):
        for j in range(3):
            weight = np.exp(-0.5 * ((particles[:, j] - measured[i, j]) / MEASUREMENT_SD[j]) ** 2)
            draws[i, :, j] = rng.choice(particles[:, j], DRAWS, p=weight / weight.sum())
    return truth, draws


def rows_of(width: float = 1.0, shift: float = 0.0) -> dict[tuple[str, float], pd.Series]:
    """Score the exact posteriors, their draws scaled about their mean by ``width`` and moved by ``shift``."""
    truth, draws = exact_posteriors()
    centre = draws.mean(axis=1, keepdims=True)
    recovered = recover(truth, centre + width * (draws - centre) + shift, PAPER_PRIOR, SETTINGS)
    return {
        (row["parameter"], row["nominal"]): row for _, row in coverage(recovered, [], SETTINGS).iterrows()
    }


def test_exact_posteriors_are_found_calibrated() -> None:
    rows = rows_of()
    assert list(rows) == [(name, level) for name in THETA_NAMES for level in LEVELS]
    for (_, level), row in rows.items():
        tolerance = 3.5 * np.sqrt(level * (1 - level) / RECORDINGS)
        assert row.coverage == pytest.approx(level, abs=tolerance)
        assert row.n == RECORDINGS
    for j, name in enumerate(THETA_NAMES):
        assert abs(rows[name, 0.9].bias) < 4.0 * MEASUREMENT_SD[j] / np.sqrt(RECORDINGS)


def test_narrow_and_shifted_posteriors_are_found_out() -> None:
    exact, narrow, shifted = rows_of(), rows_of(width=0.3), rows_of(shift=0.25)
    assert max(narrow[name, 0.9].ci_high for name in THETA_NAMES) < 0.6
    assert shifted["k_sr_per_s", 0.9].bias - exact["k_sr_per_s", 0.9].bias == pytest.approx(0.25, abs=0.1)


def test_contraction_compares_with_the_prior() -> None:
    rows, least = rows_of(), 1.0 - MEASUREMENT_SD**2 / prior_variance(PAPER_PRIOR) - 0.05
    for name, bound in zip(THETA_NAMES, least, strict=True):
        assert bound < rows[name, 0.5].contraction < 1.0
    of_prior = quantile(np.random.default_rng(6).random((RECORDINGS * 500, 3)), PAPER_PRIOR)
    useless = of_prior.reshape(RECORDINGS, 500, 3)
    found = coverage(recover(exact_posteriors()[0], useless, PAPER_PRIOR, SETTINGS), [], SETTINGS)
    np.testing.assert_allclose(found["contraction"], 0.0, atol=0.02)


def test_binomial_interval_is_clopper_pearsons() -> None:
    row = rows_of()["k0_kpa", 0.9]
    covered = round(row.coverage * row.n)
    assert row.ci_low == pytest.approx(beta.ppf(0.025, covered, row.n - covered + 1))
    assert row.ci_high == pytest.approx(beta.ppf(0.975, covered + 1, row.n - covered))


def test_recordings_that_leak_are_left_out_and_counted() -> None:
    truth, candidates = exact_posteriors()[0], exact_posteriors()[1].copy()
    candidates[:40, 99:, 1] = 99.0
    assert len(recover(truth, candidates, PAPER_PRIOR, SETTINGS)) == 3 * (RECORDINGS - 40)
    candidates[:, :, 1] = 99.0
    with pytest.raises(ValueError, match="none of the 400 synthetic recordings"):
        recover(truth, candidates, PAPER_PRIOR, SETTINGS)
