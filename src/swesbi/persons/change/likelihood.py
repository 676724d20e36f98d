"""The likelihood of several recordings of one person, whose discrepancy is partly the same.

All log speeds are normal given the walls. Within a visit their covariance is what it is alone
(``measurement.likelihood``); between visits it is the shared part of the discrepancy, share delta^2, where
the phase is the same.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import block_diag

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.measurement.likelihood import log_speed_sd
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.measurement.speeds import PredictedSpeeds, SpeedRecording

ROWS_AT_ONCE = 2000  # of factorisations of their own: 40 phases take 26 MB


def shared_errors(
    recordings: Sequence[SpeedRecording],
    phase_index: Sequence[IntArray],
    discrepancy: DiscrepancySettings,
    share: float,
) -> FloatArray:
    """Return the covariance of what log speeds of all recordings share, (q, q), q phases of all together.

    Args:
        recordings: One of each visit.
        phase_index: Numbers of the measured phases in the protocol, (p_v,) by visit.
        discrepancy: delta.
        share: Of delta^2, between visits.
    """
    within = block_diag(*(each.shared @ each.shared.T for each in recordings))
    phase = np.concatenate(list(phase_index))
    visit = np.repeat(np.arange(len(recordings)), [len(index) for index in phase_index])
    between = (phase[:, None] == phase) & (visit[:, None] != visit)
    return np.asarray(within + share * discrepancy.speed_fraction**2 * between)


def shared_factor(
    recordings: Sequence[SpeedRecording],
    phase_index: Sequence[IntArray],
    discrepancy: DiscrepancySettings,
    share: float,
) -> FloatArray:
    """Return W of the covariance W W^T of what log speeds of all recordings share; shape (q, R).

    As :func:`shared_errors`, but with share delta^2 on the diagonal as well: own errors are the less.
    """
    phase = np.concatenate(list(phase_index))
    between = np.sqrt(share) * discrepancy.speed_fraction * (phase[:, None] == np.unique(phase))
    return np.hstack([block_diag(*(each.shared for each in recordings)), between])


def stacked_covariance(
    predicted: Sequence[PredictedSpeeds],
    recordings: Sequence[SpeedRecording],
    phase_index: Sequence[IntArray],
    discrepancy: DiscrepancySettings,
    share: float,
) -> FloatArray:
    """Return the covariance of all log speeds, of one simulation each row; (n, q, q).

    It is one for all, (1, q, q), where nothing of it depends on the simulation: without errors in timing.
    Arguments as of :func:`shared_errors`; ``predicted`` are n simulations of each visit.
    """
    rows = slice(None) if discrepancy.timing_cycle else slice(1)
    own = [
        log_speed_sd(_without_slope(each, rows, discrepancy), recording.relative_se, discrepancy)
        for each, recording in zip(predicted, recordings, strict=True)
    ]
    variance = np.hstack(own) ** 2
    covariance = np.tile(shared_errors(recordings, phase_index, discrepancy, share), (len(variance), 1, 1))
    diagonal = np.arange(variance.shape[1])
    covariance[:, diagonal, diagonal] += variance
    return covariance


def _without_slope(
    predicted: PredictedSpeeds, rows: slice, discrepancy: DiscrepancySettings
) -> PredictedSpeeds:
    """Return the rows that a covariance needs; a slope that plays no part is zero, that none be NaN."""
    slope = predicted.slope[rows]
    return PredictedSpeeds(
        predicted.log_speed[rows], slope if discrepancy.timing_cycle else np.zeros_like(slope)
    )


def stacked_log_density(distance: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return log N(distance; 0, covariance), -inf where a distance is NaN; shape (n,).

    Args:
        distance: Measured less predicted log speeds; shape (n, q).
        covariance: Of each row, (n, q, q), or one for all, (1, q, q).
    """
    density = np.full(len(distance), -np.inf)
    known = np.flatnonzero(np.isfinite(distance).all(axis=1))
    if len(covariance) == 1:
        density[known] = _density(distance[known], np.asarray(np.linalg.cholesky(covariance)))
        return density
    for start in range(0, len(known), ROWS_AT_ONCE):
        rows = known[start : start + ROWS_AT_ONCE]
        density[rows] = _density(distance[rows], np.asarray(np.linalg.cholesky(covariance[rows])))
    return density


def _density(distance: FloatArray, factor: FloatArray) -> FloatArray:
    """Return the normal log densities of rows (n, q) by the Cholesky factors (n or 1, q, q)."""
    z = (
        np.linalg.solve(factor[0], distance.T).T
        if len(factor) == 1
        else np.linalg.solve(factor, distance[:, :, None])[:, :, 0]
    )
    log_root = np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1)
    constant = 0.5 * distance.shape[1] * np.log(2.0 * np.pi)
    return np.asarray(-0.5 * (z**2).sum(axis=1) - log_root - constant)
