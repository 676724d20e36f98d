"""The CMA-ES search: finds a known theta, stays within the bounds, repeats by seed, leaves no trace."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from evaluation_cases import LOSS, PRIOR, cmaes_settings, curves

from swesbi.checks.cmaes import CmaesRun, best_run, curve_loss, run_searches, to_theta
from swesbi.prior import bounds

FloatArray = np.ndarray
LOW, HIGH = bounds(PRIOR)
TRUTH = (58.0, 6.0, 28.0)


def fit(theta: tuple[float, float, float], **changes: object) -> list[CmaesRun]:
    observed = curves(np.array([theta]))[0]
    return run_searches(
        lambda trial: curve_loss(curves(trial), observed, LOSS), LOW, HIGH, cmaes_settings(**changes)
    )


@pytest.mark.parametrize("theta", [TRUTH, (30.0, 12.0, 50.0), (150.0, 2.5, 8.0)])
def test_recovers_theta_from_a_noiseless_curve(theta: tuple[float, float, float]) -> None:
    runs = fit(theta, generations=80)
    best = best_run(runs)
    np.testing.assert_allclose(best.theta, theta, rtol=1e-3)
    assert best.loss < 1e-4


def test_theta_beyond_a_bound_ends_on_the_bound() -> None:
    runs = fit((60.0, 80.0, 30.0), generations=60)
    assert best_run(runs).theta[1] == pytest.approx(HIGH[1], rel=1e-6)


def test_a_run_depends_on_its_own_seed_alone_and_not_on_the_global_random_state() -> None:
    np.random.seed(1)  # noqa: NPY002
    together = fit(TRUTH, seeds=(200, 201))
    np.random.seed(2)  # noqa: NPY002
    state = np.random.get_state()[1].copy()  # noqa: NPY002
    (alone,) = fit(TRUTH, seeds=(201,))
    assert np.array_equal(state, np.random.get_state()[1])  # noqa: NPY002
    assert np.array_equal(together[1].best_theta, alone.best_theta, equal_nan=True)
    assert not np.array_equal(together[0].best_theta, together[1].best_theta)


def test_whole_population_in_one_call_within_budget_and_bounds() -> None:
    sizes: list[int] = []

    def loss(theta: FloatArray) -> FloatArray:
        sizes.append(len(theta))
        assert np.all(theta >= LOW) and np.all(theta <= HIGH)
        return np.sum(np.log(theta / [60.0, 6.0, 30.0]) ** 2, axis=1)

    settings = cmaes_settings(seeds=(200, 201, 202), generations=30)
    runs = run_searches(loss, LOW, HIGH, settings)
    assert set(sizes) == {settings.population_size}
    assert sum(sizes) == sum(run.evaluations[-1] for run in runs) <= 3 * 30 * 12


def test_history_after_an_early_stop_is_blank() -> None:
    run = run_searches(
        lambda theta: np.zeros(len(theta)), LOW, HIGH, cmaes_settings(seeds=(200,), generations=500)
    )[0]
    assert run.generations < 500 and run.stop
    assert np.isnan(run.best_loss[run.generations :]).all()
    assert np.all(run.evaluations[run.generations :] == 12 * run.generations)


def test_failed_simulations_are_left_behind() -> None:
    observed = curves(np.array([[58.0, 6.0, 28.0]]))[0]

    def loss(theta: FloatArray) -> FloatArray:
        broken = np.where(theta[:, [0]] > 100.0, np.nan, curves(theta))
        return curve_loss(broken, observed, LOSS)

    runs = run_searches(loss, LOW, HIGH, cmaes_settings(generations=60))
    np.testing.assert_allclose(best_run(runs).theta, TRUTH, rtol=0.02)


def test_writes_no_file_and_prints_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    fit(TRUTH)
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")


def test_search_coordinates_are_logarithms_of_theta() -> None:
    corners = to_theta(np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.5, 0.5, 0.5]]), LOW, HIGH)
    np.testing.assert_allclose(corners, [LOW, HIGH, np.sqrt(LOW * HIGH)])
