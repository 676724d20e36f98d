"""The raw samples of one recording, and quality control: which are accepted, and why others are not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.recording.groups import grouped
from swesbi.recording.problems import Problem, RecordingError
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.tables.columns import FAILED_STATUSES, STATUSES

ACCEPTED: Final = -1
REASONS: Final = (*FAILED_STATUSES, "empty_speed", "low_fit_r2", "ectopic_rr", "outlier", "sparse_phase")
CONFIGURED: Final = "recording.phases in config.yaml"
OUTLIER: Final = REASONS.index("outlier")
MAD_TO_SD: Final = 1.4826  # of a normal distribution: 1 / Phi^-1(3/4)


@dataclass(frozen=True)
class Samples:
    """Columns of ``swe/<subject>.csv``, each of shape (N,), N attempted samples.

    Attributes:
        phase_index: Index of the gated phase, from 0.
        trigger_delay_ms: Delay of the push from the R peak.
        rr_ms: RR interval of the beat in which the sample was taken.
        repeat: Index of the repeated acquisition at that phase.
        sample: Index of the spatial sample within the repeat.
        speed_m_s: Shear-wave speed c_s; NaN where the estimate failed.
        fit_r2: R2 of the wave fit; NaN where there was none.
        status: "ok" or one of ``FAILED_STATUSES``.
        source: Where the samples come from, for messages.
        unused: Columns of the file that nobody asks for and in which its rows differ.
        phases_said_in: Where the number of phases is said, for messages.
    """

    phase_index: IntArray
    trigger_delay_ms: FloatArray
    rr_ms: FloatArray
    repeat: IntArray
    sample: IntArray
    speed_m_s: FloatArray
    fit_r2: FloatArray
    status: NDArray[np.str_]
    source: str = "samples in memory"
    unused: tuple[str, ...] = ()
    phases_said_in: str = CONFIGURED

    def __post_init__(self) -> None:
        known = np.isin(self.status, STATUSES)
        if not known.all():
            reason = f"is none of {', '.join(STATUSES)}"
            value = str(self.status[~known][0])
            raise RecordingError(
                Problem(self.source, reason, "use one of them", column="status", value=value)
            )

    @property
    def beat_phase(self) -> FloatArray:
        """Phase of each sample in its own beat, trigger delay / RR, beside those of its gate; shape (N,).

        Of a gate at the R peak some lie at the end of a beat and some at the beginning of the next.
        """
        return grouped(self.phase_index).unwrapped(self.trigger_delay_ms / self.rr_ms)

    @property
    def median_rr_ms(self) -> float:
        """Median RR interval over the acquisitions, one a phase and repeat, whatever their samples."""
        return float(np.median(grouped(self.phase_index, self.repeat).medians(self.rr_ms)))


def sample_rejection(samples: Samples, settings: RecordingSettings) -> IntArray:
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


def ectopic(samples: Samples, max_deviation_fraction: float) -> BoolArray:
    """Return which samples lie in a beat whose RR is too far from the recording's median RR; shape (N,).

    The rule is the percentage filter of heart-rate-variability analysis (Malik et al. 1989), taken
    against the median since gated beats are not consecutive.
    """
    deviation = np.abs(samples.rr_ms / samples.median_rr_ms - 1.0)
    return np.asarray(deviation > max_deviation_fraction)


def count_by_phase(samples: Samples, verdict: IntArray, phases: int) -> tuple[IntArray, IntArray]:
    """Count accepted samples, shape (P,), and rejected ones by reason, shape (reasons, P)."""
    counts = np.zeros((len(REASONS) + 1, phases), dtype=np.int64)
    np.add.at(counts, (verdict, samples.phase_index), 1)
    return counts[ACCEPTED], counts[:ACCEPTED]


def count_by_repeat(samples: Samples, accepted: BoolArray, phases: int) -> IntArray:
    """Count the accepted samples of each phase and repeat; shape (P, repeats).

    Columns are the repeats that the recording has, in ascending order, whether or not a phase has them.
    """
    repeats, column = np.unique(samples.repeat, return_inverse=True)
    counts = np.zeros((phases, repeats.size), dtype=np.int64)
    np.add.at(counts, (samples.phase_index[accepted], column[accepted]), 1)
    return counts


def _reject(verdict: IntArray, wrong: BoolArray, reason: str) -> None:
    verdict[wrong & (verdict == ACCEPTED)] = REASONS.index(reason)


def _outlier(samples: Samples, kept: BoolArray, settings: RecordingSettings) -> BoolArray:
    # The modified z-score of Iglewicz and Hoaglin (1993) on relative deviations from the phase median:
    # the noise is proportional to the speed, so its scale is common to all phases and estimated from all.
    outlier = np.zeros(kept.shape, dtype=np.bool_)
    if not kept.any():
        return outlier
    speed, phases = samples.speed_m_s[kept], grouped(samples.phase_index[kept])
    deviation = np.abs(np.log(speed / phases.medians(speed)[phases.of]))
    scale = max(MAD_TO_SD * float(np.median(deviation)), settings.outlier_min_scale_fraction)
    outlier[kept] = deviation > settings.outlier_max_abs_z * scale
    return outlier


def _sparse(samples: Samples, kept: BoolArray, settings: RecordingSettings) -> BoolArray:
    phase_index = samples.phase_index[kept]
    phases, repeats = grouped(phase_index), grouped(phase_index, samples.repeat[kept])
    counted = np.bincount(phases.of[repeats.first], minlength=len(phases.first))
    enough = (phases.sizes >= settings.min_samples_per_phase) & (counted >= settings.min_repeats_per_phase)
    return ~np.isin(samples.phase_index, phase_index[phases.first][enough])
