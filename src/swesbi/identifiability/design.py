"""What other recordings would tell: information of any phases and repeats, and a choice of phases.

The likelihood of a recording takes the model's errors to be independent from phase to phase. Recordings
with phases closer together than the shipped ones would average such errors away, which real model errors,
being continuous over the cycle, do not allow. Here their correlation falls linearly to zero over a given
distance (a tent, positive definite on the circle), so that both agree where phases are further apart.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from swesbi.identifiability.laplace import expected_variance
from swesbi.identifiability.speeds import SpeedDerivatives
from swesbi.recording.speed import NoiseComponents
from swesbi.speed_model.settings import DiscrepancySettings

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def uniform_phases(count: int, offset: float = 0.5) -> FloatArray:
    """Return ``count`` evenly spaced phases; the first lies at ``offset`` of their distance."""
    return (np.arange(count) + offset) / count


def single_repeat_variance(noise: NoiseComponents, samples_by_repeat: IntArray) -> float:
    """Return the squared relative standard error of the mean speed of one repeat, of its usual size.

    s_rep^2 + s_sam^2 / n, averaged over the repeats (P, R) that have accepted samples n.
    """
    samples = samples_by_repeat[samples_by_repeat > 0]
    return float(noise.repeat_fraction**2 + noise.sample_fraction**2 * np.mean(1.0 / samples))


def correlation(phase: FloatArray, range_cycle: float) -> FloatArray:
    """Return the correlation (..., p, p) of model errors at phases (..., p), around the cycle."""
    distance = np.abs(phase[..., :, None] - phase[..., None, :])
    around = np.minimum(distance, 1.0 - distance)
    return np.asarray(np.maximum(1.0 - around / range_cycle, 0.0))


def design_information(
    at: SpeedDerivatives,
    noise_variances: Sequence[float],
    discrepancy: DiscrepancySettings,
    error_correlation: FloatArray,
) -> FloatArray:
    """Return the expected information about log phi of speeds at the phases of ``at``, by noise.

    For log speeds ~ N(m, C) with C = se^2 1 + K (delta^2 + tau^2 s s'), s the slopes and K the
    correlation of model errors, I_jk = m_j' C^-1 m_k + 1/2 tr(C^-1 C_j C^-1 C_k), where an index is a
    derivative (Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, 1993, Eq. 3.31).
    In the eigenvectors of the second term of C, the matrix is diagonal whatever the noise.

    Args:
        at: Derivatives at the phases; (..., p) and (..., d, p).
        noise_variances: Squared relative standard errors of the mean speed at each phase; r of them.
        discrepancy: delta and tau.
        error_correlation: K, (..., p, p).

    Returns:
        Information; (r, ..., d, d).
    """
    timing, slope = discrepancy.timing_cycle**2, at.slope
    model_error = discrepancy.speed_fraction**2 + timing * slope[..., :, None] * slope[..., None, :]
    value, vector = np.linalg.eigh(error_correlation * model_error)
    half = at.slope_by[..., :, None] * slope[..., None, None, :]
    change = timing * error_correlation[..., None, :, :] * (half + np.swapaxes(half, -1, -2))
    turned = vector[..., None, :, :]
    change = np.swapaxes(turned, -1, -2) @ change @ turned
    mean_by = at.log_speed_by @ vector
    return np.stack(
        [_in_eigenvectors(mean_by, change, 1.0 / (np.maximum(value, 0.0) + v)) for v in noise_variances]
    )


def _in_eigenvectors(mean_by: FloatArray, change: FloatArray, weight: FloatArray) -> FloatArray:
    """Return I for weights (..., p) = 1 / eigenvalues of C, with m_j (..., d, p) and C_j (..., d, p, p)."""
    root = np.sqrt(weight)
    mean_by = mean_by * root[..., None, :]
    change = change * (root[..., :, None] * root[..., None, :])[..., None, :, :]
    flat = change.reshape(*change.shape[:-2], -1)
    return np.asarray(mean_by @ np.swapaxes(mean_by, -1, -2) + 0.5 * flat @ np.swapaxes(flat, -1, -2))


def choose_phases(
    candidates: Sequence[SpeedDerivatives],
    noise_variance: Sequence[float],
    discrepancy: DiscrepancySettings,
    range_cycle: float,
    precision: FloatArray,
    wanted: Sequence[int],
    count: int,
) -> IntArray:
    """Choose phases one after the other, each the best addition to those before, for all subjects at once.

    The best is that with the least sum, over subjects and wanted parameters, of the log of the expected
    posterior variance: gains count by their ratio, in whatever parameter or subject.

    Args:
        candidates: Each subject's derivatives at the same candidate phases.
        noise_variance: Of each subject's mean speed at a phase.
        discrepancy: delta and tau.
        range_cycle: Distance over which model errors are correlated.
        precision: Of the prior; (d, d).
        wanted: Indices of the parameters that the recording is made for.
        count: How many phases to choose.

    Returns:
        Indices of the chosen candidates, in the order of choice; (count,).
    """
    chosen: list[int] = []
    for _ in range(count):
        left = np.setdiff1d(np.arange(len(candidates[0].phase)), chosen)
        sets = np.column_stack([np.tile(chosen, (len(left), 1)).astype(np.int64), left])
        cost = sum(
            _cost(one, sets, variance, discrepancy, range_cycle, precision, wanted)
            for one, variance in zip(candidates, noise_variance, strict=True)
        )
        chosen.append(int(left[np.argmin(cost)]))
    return np.array(chosen)


def _cost(
    candidates: SpeedDerivatives,
    sets: IntArray,
    noise_variance: float,
    discrepancy: DiscrepancySettings,
    range_cycle: float,
    precision: FloatArray,
    wanted: Sequence[int],
) -> FloatArray:
    """Return the sum of log expected variances for sets (m, p) of phases, shape (m,)."""
    parts = (candidates.slope, candidates.log_speed_by, candidates.slope_by)
    slope, log_speed_by, slope_by = (np.moveaxis(part[..., sets], -2, 0) for part in parts)
    at = SpeedDerivatives(candidates.phase[sets], slope, log_speed_by, slope_by)
    error_correlation = correlation(at.phase, range_cycle)[:, None]
    information = design_information(at, [noise_variance], discrepancy, error_correlation)[0]
    gradient = np.broadcast_to(
        np.eye(len(precision))[list(wanted)], (slope.shape[1], len(wanted), len(precision))
    )
    variance = expected_variance(precision, information, gradient).mean(axis=-2)
    return np.asarray(np.log(variance).sum(axis=-1))
