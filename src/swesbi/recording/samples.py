"""The attempted samples of one recording, their groups, and which are accepted by themselves, or why not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.tables.layout import FAILED_STATUSES


@dataclass(frozen=True)
class Groups:
    """Which of n values belong together, G groups in the ascending order of their keys.

    ``of`` is the group of each value (n,), from 0, ``first`` the first value of each group (G,).
    """

    of: IntArray
    first: IntArray

    @property
    def sizes(self) -> IntArray:
        """Number of values in each group; shape (G,)."""
        return np.bincount(self.of, minlength=len(self.first)).astype(np.int64)

    def sums(self, values: FloatArray) -> FloatArray:
        """Return the sum of each group over values (n,); shape (G,)."""
        return np.bincount(self.of, weights=values, minlength=len(self.first)).astype(np.float64)

    def means(self, values: FloatArray) -> FloatArray:
        """Return the mean of each group over values (n,); shape (G,)."""
        return self.sums(values) / self.sizes

    def medians(self, values: FloatArray) -> FloatArray:
        """Return the median of each group over values (n,); shape (G,)."""
        return np.array([np.median(values[self.of == group]) for group in range(len(self.first))])

    def unwrapped(self, phase: FloatArray) -> FloatArray:
        """Return phases (n,) of period 1 of which those of a group lie together; (n,).

        Of a group that spans half a period or more, what lies behind the seam of the cycle is moved on by a
        period.
        """
        spans = self.largest(phase) + self.largest(-phase) >= 0.5
        return np.where(spans[self.of] & (phase < 0.5), phase + 1.0, phase)

    def largest(self, values: FloatArray) -> FloatArray:
        """Return the largest of each group over values (n,); shape (G,)."""
        return np.array([np.max(values[self.of == group]) for group in range(len(self.first))])

    def scatter(self, values: FloatArray) -> FloatArray:
        """Return the sum of squared deviations from the mean of each group, over values (n,); shape (G,)."""
        return self.sums((values - self.means(values)[self.of]) ** 2)


def grouped(outer: IntArray, inner: IntArray | None = None) -> Groups:
    """Group values by one key from 0, or by two, the second within the first."""
    keys = outer if inner is None or len(inner) == 0 else outer * (inner.max() + 1) + inner
    _, first, of = np.unique(keys, return_index=True, return_inverse=True)
    return Groups(of.astype(np.int64), first.astype(np.int64))


ACCEPTED: Final = -1
REASONS: Final = (*FAILED_STATUSES, "empty_speed", "low_fit_r2", "ectopic_rr", "outlier", "sparse_phase")
CONFIGURED: Final = "recording.phases in config.yaml"
OUTLIER: Final = REASONS.index("outlier")
MAD_TO_SD: Final = 1.4826  # of a normal distribution: 1 / Phi^-1(3/4)


@dataclass(frozen=True)
class Samples:
    """Columns of a recording, each of shape (N,), N attempted samples or pushes; None where it has none.

    A gated recording has gates, which are measured again and again. A free-running one has pushes at any
    instants of any beats. Times are since the R peak of the push's beat. ``repeat`` is that of a gate, or the
    train of pushes, 0 where the file does not say; ``sample`` is within the repeat. Speeds are NaN where the
    estimate failed, standard errors and R2 where none is given. ``unit_of_time`` is what is stated of the
    times, ``places`` where each row stands, ``left_out`` what of the file is not used though it may matter.
    """

    time_ms: FloatArray
    rr_ms: FloatArray
    repeat: IntArray
    speed_m_s: FloatArray
    status: NDArray[np.str_]
    gate: IntArray | None = None
    sample: IntArray | None = None
    beat: IntArray | None = None
    se_m_s: FloatArray | None = None
    fit_r2: FloatArray | None = None
    unit_of_time: str = ""
    source: str = "samples in memory"
    places: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    phases_source: str = CONFIGURED

    @property
    def is_gated(self) -> bool:
        """Whether the recording has gates."""
        return self.gate is not None

    @property
    def phase_index(self) -> IntArray:
        """Index of the gated phase of each sample; (N,)."""
        if self.gate is None:
            raise ValueError("a free-running recording has no gates")
        return self.gate

    @property
    def beat_phase(self) -> FloatArray:
        """Phase of each sample in its own beat, time / RR; (N,).

        Of a gate at the R peak some lie at the end of a beat and some at the beginning of the next: these
        lie together. Pushes without gates lie in [0, 1).
        """
        share = self.time_ms / self.rr_ms
        return share % 1.0 if self.gate is None else grouped(self.gate).unwrapped(share)

    @property
    def beats(self) -> Groups:
        """The samples of each beat, as far as it is known: one acquisition of a gate, or a numbered beat."""
        if self.gate is not None:
            return grouped(self.gate, self.repeat)
        return grouped(np.arange(len(self.rr_ms)) if self.beat is None else self.repeat, self.beat)

    @property
    def beats_rr_ms(self) -> FloatArray:
        """RR interval of each beat, the median over its samples; shape (beats,)."""
        if self.gate is None and self.beat is None:
            return self.rr_ms
        return self.beats.medians(self.rr_ms)

    @property
    def median_rr_ms(self) -> float:
        """Median RR interval over the beats, whatever their samples."""
        return float(np.median(self.beats_rr_ms))


def sample_rejection(samples: Samples, settings: RecordingSettings) -> IntArray:
    """Return for each sample the index into ``REASONS`` of its rejection, or ``ACCEPTED``; shape (N,).

    Each is rejected for one reason, the first that applies in the order of ``REASONS``: its reported status;
    an empty speed; a fit R2 that is low or missing, where the file has one; a beat whose RR is ectopic; of
    gates also a speed that is an outlier of its phase, and a phase with too few samples or repeats left.
    """
    verdict = np.full(samples.status.shape, ACCEPTED, dtype=np.int64)
    for status in FAILED_STATUSES:
        _reject(verdict, samples.status == status, status)
    _reject(verdict, np.isnan(samples.speed_m_s), "empty_speed")
    if samples.fit_r2 is not None:
        _reject(verdict, ~(samples.fit_r2 >= settings.min_fit_r2), "low_fit_r2")
    _reject(verdict, ectopic(samples, settings.max_rr_deviation_fraction), "ectopic_rr")
    if samples.gate is not None:
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
