"""Quality control: which samples are accepted, and for what reason each of the others is not."""

from __future__ import annotations

from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.recording.samples import FAILED_STATUSES, Samples
from swesbi.recording.settings import RecordingSettings

ACCEPTED: Final = -1
REASONS: Final = (*FAILED_STATUSES, "empty_speed", "low_fit_r2", "ectopic_rr", "outlier", "sparse_phase")
MAD_TO_SD: Final = 1.4826  # of a normal distribution: 1 / Phi^-1(3/4)


def rejection(samples: Samples, settings: RecordingSettings) -> NDArray[np.int64]:
    """Return for each sample the index into ``REASONS`` of its rejection, or ``ACCEPTED``; shape (N,).

    Each sample is rejected for one reason, the first that applies in the order of ``REASONS``: its
    reported status; an empty speed; a fit R2 that is low or missing; a beat whose RR is ectopic; a
    speed that is an outlier of its phase; a phase with too few samples or repeats left.
    """
    verdict = np.full(samples.status.shape, ACCEPTED, dtype=np.int64)
    for status in FAILED_STATUSES:
        _reject(verdict, samples.status == status, status)
    _reject(verdict, np.isnan(samples.speed_m_s), "empty_speed")
    _reject(verdict, ~(samples.fit_r2 >= settings.min_fit_r2), "low_fit_r2")
    _reject(verdict, ectopic(samples, settings.max_rr_deviation_fraction), "ectopic_rr")
    _reject(verdict, _outlier(samples, verdict == ACCEPTED, settings), "outlier")
    _reject(verdict, _sparse(samples, verdict == ACCEPTED, settings), "sparse_phase")
    return verdict


def ectopic(samples: Samples, max_deviation_fraction: float) -> NDArray[np.bool_]:
    """Return which samples lie in a beat whose RR is too far from the recording's median RR; shape (N,).

    The rule is the percentage filter of heart-rate-variability analysis (Malik et al. 1989), taken
    against the median since gated beats are not consecutive. The median is over the acquisitions
    (one per phase and repeat), whatever their number of samples.
    """
    beats = samples.frame().groupby(["phase_index", "repeat"])["rr_ms"].median()
    deviation = np.abs(samples.rr_ms / float(beats.median()) - 1.0)
    return np.asarray(deviation > max_deviation_fraction)


def count_by_phase(
    samples: Samples, verdict: NDArray[np.int64], phases: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Count accepted samples, shape (P,), and rejected ones by reason, shape (reasons, P)."""
    counts = np.zeros((len(REASONS) + 1, phases), dtype=np.int64)
    np.add.at(counts, (verdict, samples.phase_index), 1)
    return counts[ACCEPTED], counts[:ACCEPTED]


def count_by_repeat(samples: Samples, accepted: NDArray[np.bool_], phases: int) -> NDArray[np.int64]:
    """Count the accepted samples of each phase and repeat; shape (P, repeats).

    Columns are the repeats that the recording has, in ascending order, whether or not a phase has them.
    """
    repeats, column = np.unique(samples.repeat, return_inverse=True)
    counts = np.zeros((phases, repeats.size), dtype=np.int64)
    np.add.at(counts, (samples.phase_index[accepted], column[accepted]), 1)
    return counts


def _reject(verdict: NDArray[np.int64], wrong: NDArray[np.bool_], reason: str) -> None:
    verdict[wrong & (verdict == ACCEPTED)] = REASONS.index(reason)


def _outlier(samples: Samples, kept: NDArray[np.bool_], settings: RecordingSettings) -> NDArray[np.bool_]:
    # The modified z-score of Iglewicz and Hoaglin (1993) on relative deviations from the phase median:
    # the noise is proportional to the speed, so its scale is common to all phases and estimated from all.
    speed = pd.Series(np.where(kept, samples.speed_m_s, np.nan))
    median = speed.groupby(samples.phase_index).transform("median")
    deviation = np.abs(np.log((speed / median).to_numpy(dtype=np.float64)))
    if not kept.any():
        return np.zeros(kept.shape, dtype=np.bool_)
    scale = max(MAD_TO_SD * float(np.nanmedian(deviation)), settings.outlier_min_scale_fraction)
    return np.asarray(deviation > settings.outlier_max_abs_z * scale)


def _sparse(samples: Samples, kept: NDArray[np.bool_], settings: RecordingSettings) -> NDArray[np.bool_]:
    table = pd.DataFrame({"repeat": samples.repeat[kept], "phase": samples.phase_index[kept]})
    found = table.groupby("phase")["repeat"].agg(["size", "nunique"])
    enough = (found["size"] >= settings.min_samples_per_phase) & (
        found["nunique"] >= settings.min_repeats_per_phase
    )
    return ~np.isin(samples.phase_index, found.index[enough].to_numpy())
