"""Standard errors of the mean speeds of phases, and what the phases of a sweep share of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.recording.speed import NoiseComponents


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
