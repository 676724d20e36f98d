"""Standard errors of speeds: of the means of phases by their repeats, or of pushes by what is said of them.

A free-running recording has no repeats. Its errors stand in the file, or follow from the quality of its fits,
or are declared: then the declared coefficient of variation is not assumed but has a log-normal prior, and is
integrated out of the likelihood (``measurement.shared_error``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.recording.problems import refusal
from swesbi.recording.samples import Samples
from swesbi.recording.settings import NoiseDeclaration
from swesbi.recording.speed import NoiseComponents
from swesbi.recording.tables.layout import STANDARD_ERROR

NoiseSource = Literal["se_m_s", "fit_r2", "declared"]
DECLARE: Final = (
    "add a column se_m_s; or declare in recording.yaml, or in swe/<subject>.yaml, "
    "`noise: { cv_fraction: 0.1, cv_log_sd: 0.3 }`, or `noise: { fit_points: 12 }` where each speed is the "
    "slope of a line through so many points and fit_r2 its R2"
)


def relative_se(samples_by_repeat: IntArray, noise: NoiseComponents) -> FloatArray:
    """Return the standard error of each phase's mean speed as a fraction of it, (p,); NaN without samples.

    Accepted samples of each repeat are (p, repeats). The mean is over repeat means, so with R repeats of
    n_r accepted samples it is
    sqrt(sum_r (s_rep^2 + s_swp^2 + s_sam^2 / n_r)) / R; repeats without an accepted sample do not count.
    What the means of several phases share, where repeats are sweeps, is in :func:`mean_errors`.
    """
    counted = samples_by_repeat > 0
    of_repeat = noise.repeat_fraction**2 + noise.sweep_fraction**2
    per_repeat = of_repeat + noise.sample_fraction**2 / np.maximum(samples_by_repeat, 1)
    repeats = counted.sum(axis=1)
    variance = np.where(counted, per_repeat, 0.0).sum(axis=1)
    return np.where(repeats > 0, np.sqrt(variance) / np.maximum(repeats, 1), np.nan)


@dataclass(frozen=True)
class MeanErrors:
    """Errors of a recording's mean log speeds at p phases, from K sweeps; or of n recordings, (n, ...).

    ``own`` (p,) is the standard deviation of what each mean has for itself, ``shared`` (p, K) the factor W of
    what they share, with K = 0 where repeats are separate.
    """

    own: FloatArray
    shared: FloatArray

    @classmethod
    def separate(cls, own: FloatArray) -> MeanErrors:
        """Return errors that share nothing."""
        return cls(own, np.empty((*own.shape, 0)))

    @property
    def total(self) -> FloatArray:
        """Standard error of each mean, sqrt(own^2 + sum_k W_k^2); shape (p,)."""
        return np.asarray(np.sqrt(self.own**2 + (self.shared**2).sum(axis=-1)))

    @property
    def covariance(self) -> FloatArray:
        """The covariance of the means of one recording, diag(own^2) + shared shared^T; shape (p, p)."""
        return np.diag(self.own**2) + self.shared @ self.shared.T


def mean_errors(samples_by_repeat: IntArray, noise: NoiseComponents) -> MeanErrors:
    """Return the errors of each phase's mean speed, those apart that all phases of a sweep share.

    The mean at phase i weighs its R_i repeats with accepted samples by W_ir = 1 / R_i, the others by 0. With
    log speeds mu_i + v_r + u_ir + e_irj (``sweeps``) the means have, to first order in the errors, the
    covariance

        diag(d^2) + s_swp^2 W W^T,    d_i^2 = sum_{r in i} (s_rep^2 + s_sam^2 / n_ir) / R_i^2

    (of linear combinations of random effects: Searle, Casella and McCulloch 1992, Ch. 6). It is exact in W: a
    sweep that misses a phase shares nothing with it. Where all phases have the same R repeats, s_swp^2 W W^T
    is s_swp^2 / R in every place, of rank one. Accepted samples of each repeat are (p, K), a column a sweep.
    Errors are NaN at phases without samples.
    """
    own = relative_se(samples_by_repeat, NoiseComponents(noise.repeat_fraction, noise.sample_fraction))
    if noise.sweep_fraction == 0.0:
        return MeanErrors.separate(own)
    counted = (samples_by_repeat > 0).astype(np.float64)
    repeats = counted.sum(axis=1, keepdims=True)
    weights = np.where(repeats > 0.0, counted / np.maximum(repeats, 1.0), np.nan)
    return MeanErrors(own, noise.sweep_fraction * weights)


@dataclass(frozen=True)
class DeclaredNoise:
    """Errors of n speeds, relative (n,), where declared their prior median, and what they are computed from.

    ``log_sd`` is the standard deviation of the logarithm of what all are multiplied by; 0 where they are
    known.
    """

    relative_se: FloatArray
    log_sd: float
    source: NoiseSource


def declared_noise(samples: Samples, accepted: BoolArray, declared: NoiseDeclaration) -> DeclaredNoise:
    """Return the errors of the accepted speeds: of the file before anything that is declared.

    The slope of a line through n points has, by least squares, the relative standard error
    sqrt((1 / R2 - 1) / (n - 2)): its t statistic is sqrt((n - 2) R2 / (1 - R2)) (Draper and Smith, Applied
    Regression Analysis, 1998, Ch. 6). A speed is that slope or its inverse, to first order with the same one.
    Where nothing tells the errors, or that of an accepted push is missing, the recording is refused.
    """
    count = int(accepted.sum())
    if samples.se_m_s is not None:
        relative, empty = (
            (samples.se_m_s / samples.speed_m_s)[accepted],
            "is empty beside a speed that is accepted",
        )
        _check_all(samples, accepted, relative, samples.se_m_s, STANDARD_ERROR, empty)
        return DeclaredNoise(relative, 0.0, "se_m_s")
    if declared.fit_points is not None:
        every = np.full(len(accepted), np.nan) if samples.fit_r2 is None else samples.fit_r2
        r2 = every[accepted]
        with np.errstate(divide="ignore", invalid="ignore"):
            relative = np.sqrt((1.0 / r2 - 1.0) / (declared.fit_points - 2))
        wrong = np.where((r2 > 0.0) & (r2 < 1.0), relative, np.nan)
        _check_all(samples, accepted, wrong, every, "fit_r2", "tells no error: it must lie between 0 and 1")
        return DeclaredNoise(relative, 0.0, "fit_r2")
    if declared.cv_fraction is not None and declared.cv_log_sd is not None:
        return DeclaredNoise(np.full(count, declared.cv_fraction), declared.cv_log_sd, "declared")
    reason = "has no repeats at a phase, and nothing says how large the errors of its speeds are"
    raise refusal(samples.source, reason, DECLARE)


def _check_all(
    samples: Samples,
    accepted: BoolArray,
    relative: FloatArray,
    values: FloatArray,
    column: str,
    reason: str,
) -> None:
    """Refuse an accepted push without a usable error; the first is named by its instant."""
    missing = np.flatnonzero(np.isnan(relative))
    if missing.size:
        index = np.flatnonzero(accepted)[missing[0]]
        raise refusal(
            samples.source,
            f"of the push at time_ms {samples.time_ms[index]:g} ({missing.size} of {accepted.sum()} pushes) "
            f"{reason}",
            "give it, or another status than ok",
            column=column,
            value="" if np.isnan(values[index]) else f"{values[index]:g}",
        )
