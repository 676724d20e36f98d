"""What the shipped step does to the curves and to a posterior made from them."""

from __future__ import annotations

import numpy as np
import pytest
from forward_model_cases import COHORT, SETTINGS, prior_draws

from swesbi.context import Context
from swesbi.heart.periodic import Status
from swesbi.heart.simulate import simulate

CONVERGED = SETTINGS.model_copy(
    update={"steps_per_beat": 6400, "periodicity_tolerance": 1e-10, "maximum_beats": 300}
)
HALVED = SETTINGS.model_copy(update={"steps_per_beat": 2 * SETTINGS.steps_per_beat})

# A to D: the volunteers' own theta; E's and F's lie outside the prior, which stands in with its centre.
VOLUNTEERS = {
    "A": [55.0, 6.0, 28.0],
    "B": [80.0, 6.5, 30.0],
    "C": [79.0, 7.0, 33.0],
    "D": [86.0, 5.5, 25.0],
    "E": [45.0, 5.0, 30.0],
    "F": [45.0, 5.0, 30.0],
}


@pytest.mark.slow
def test_error_of_the_stiffness_curve() -> None:
    """1,000 prior draws of each subject against a converged periodic solution, stopping error included."""
    theta = prior_draws(1_000, seed=21)
    errors = []
    for context in COHORT.values():
        exact = simulate(theta, context, CONVERGED)
        beats = simulate(theta, context, SETTINGS)
        assert (exact.status == Status.PERIODIC).all()
        assert (beats.status == Status.PERIODIC).all()
        error = np.abs(beats.active_stiffness_kpa - exact.active_stiffness_kpa).max(axis=1)
        errors.append(error / exact.active_stiffness_kpa.max(axis=1))
    p95, worst = np.percentile(errors, 95), np.max(errors)
    print(f"error of k_c relative to its peak: 95 % {p95:.1e}, worst {worst:.1e}")
    assert p95 <= 1e-3
    assert worst <= 5e-3


@pytest.mark.parametrize("context", COHORT.values(), ids=COHORT)
def test_halving_the_step_moves_a_posterior_by_less_than_its_monte_carlo_error(context: Context) -> None:
    """Shift of the posterior mean in posterior standard deviations, linearised at the volunteer's own theta.

    Likelihood: 20 phases, stiffness to 5.4 % (speed to 2.7 %); the prior's log-sd; 5,000 posterior draws.
    """
    theta = np.array([VOLUNTEERS[context.subject]])
    phases = np.arange(0, SETTINGS.samples_per_beat, SETTINGS.samples_per_beat // 20)

    def stiffness(values: np.ndarray, settings: object = HALVED) -> np.ndarray:
        return simulate(values, context, settings).active_stiffness_kpa[:, phases]  # type: ignore[arg-type]

    base = stiffness(theta)
    noise_sd = 0.054 * (base + 4.5)
    slopes = [(stiffness(theta * (1.0 + 0.01 * unit)) - base) / np.log(1.01) for unit in np.eye(3)]
    jacobian = np.stack(slopes, axis=-1) / noise_sd[..., None]
    prior_precision = np.diag(1.0 / np.array([0.5, 0.6, 0.45]) ** 2)
    covariance = np.linalg.inv(np.swapaxes(jacobian, 1, 2) @ jacobian + prior_precision)
    difference = (stiffness(theta, SETTINGS) - base) / noise_sd
    gradient = np.einsum("nij,ni->nj", jacobian, difference)
    shift = np.einsum("njk,nk->nj", covariance, gradient) / np.sqrt(np.einsum("njj->nj", covariance))
    print(f"{context.subject}: largest shift {np.abs(shift).max():.4f} posterior standard deviations")
    assert np.abs(shift).max() < 5_000**-0.5
