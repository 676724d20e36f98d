"""Variance components of repeats that are sweeps over the cycle: a crossed mixed model, fitted by REML.

Where one repeat runs over all phases, they share its error. The log speed of sample j of sweep r in cell i
(one phase of one subject) is

    y_irj = mu_i + v_r + u_ir + e_irj,   v_r ~ N(0, s_swp^2),  u_ir ~ N(0, s_rep^2),  e_irj ~ N(0, s_sam^2),

with fixed cells, and sweeps of one recording that have nothing to do with those of another. Given what
sweeps add, the model is that of separate repeats (``components``). With w_ir = 1 / (s_rep^2 + s_sam^2 / n_ir)
the weight of a repeat mean m_ir and m_i the weighted mean of a cell, a recording tells of its sweeps

    A = diag(sum_i w_ir) - sum_i w_i w_i^T / sum_r w_ir    and    b_r = sum_i w_ir (m_ir - m_i),

and by the determinant lemma and Woodbury's identity the restricted likelihood (Searle, Casella and
McCulloch, Variance Components, 1992, Sec. 6.6) is that of separate repeats and, summed over the recordings,

    -1/2 [log |I + s_swp^2 A| - s_swp^2 b^T (I + s_swp^2 A)^-1 b].

No matrix is larger than the sweeps of one recording.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import ClassVar, Final, Self

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray, IntArray
from swesbi.recording.noise.components import LARGEST_SD, SMALLEST_SD, TOLERANCE, RepeatLevels
from swesbi.recording.samples import Samples, grouped
from swesbi.recording.settings import Repeats
from swesbi.recording.speed import NoiseComponents, repeat_means

SAMPLE: Final = 1  # place among the components
START: Final = (0.3, 1.0, 0.3)  # variances over that within repeats, where the search begins
MAX_SEARCHES: Final = 10
RELATIVE_RISE: Final = 1e-12  # what rounding may add to the likelihood
NOT_CROSSED: Final = "no sweep has samples at two phases that were measured twice"
ONE_NUMBER: Final = "give a sweep the same repeat number at all its phases, or say that repeats are separate"


@dataclass(frozen=True)
class SweepLevels(RepeatLevels):
    """Repeats of which one number stands for one sweep at all phases of a recording.

    ``recording`` and the ``sweep`` within it are numbers from 0, without gaps; shape (R,).
    """

    names: ClassVar[tuple[str, ...]] = ("repeat", "sample", "sweep")
    recording: IntArray
    sweep: IntArray

    @classmethod
    def of(cls, samples: Samples, accepted: BoolArray) -> Self:
        """Reduce the accepted samples of one recording to its repeats, as of separate ones."""
        levels = RepeatLevels.of(samples, accepted)
        sweep = grouped(repeat_means(samples, accepted).repeat).of
        return cls(**vars(levels), recording=np.zeros(levels.repeats, np.int64), sweep=sweep)

    @classmethod
    def joined(cls, recordings: Sequence[Self]) -> Self:
        """Join recordings; no two share a cell or a sweep."""
        first = np.cumsum([0, *(levels.recording.max(initial=-1) + 1 for levels in recordings)])
        pairs = zip(recordings, first, strict=False)
        return super().joined([replace(own, recording=own.recording + n) for own, n in pairs])

    @property
    def is_crossed(self) -> bool:
        """Whether any sweep has samples at two phases that were measured twice.

        Otherwise what sweeps differ by cannot be separated from what repeats differ by: the mean of a phase
        that was measured once takes both.
        """
        twice = np.bincount(self.cell)[self.cell] > 1
        sweeps = np.stack([self.recording, self.sweep])[:, twice]
        return bool(np.unique(sweeps, axis=1, return_counts=True)[1].max(initial=0) > 1)

    def log_likelihood(self, noise: NoiseComponents) -> float:
        """Return the restricted log likelihood of components, but for a constant."""
        return _likelihood(self, np.array(list(vars(noise).values())) ** 2)[0]

    @cached_property
    def place(self) -> tuple[IntArray, IntArray, IntArray]:
        """Recording, phase and sweep of each repeat, its place in the tables."""
        first = np.full(int(self.recording.max()) + 1, self.cells)
        np.minimum.at(first, self.recording, self.cell)
        return self.recording, self.cell - first[self.recording], self.sweep

    def table(self, values: FloatArray) -> FloatArray:
        """Return values of the repeats as a table, zero where there is none; shape (n, P, K)."""
        table = np.zeros([int(index.max()) + 1 for index in self.place])
        table[self.place] = values
        return table

    @cached_property
    def maximum(self) -> tuple[NoiseComponents, float]:
        """The components of the highest likelihood, and how high it is; refused where sweeps do not cross.

        Nothing is measured as finely as the smallest: a search ends beside zero where it means zero.
        """
        variances, top = self._searched
        return NoiseComponents(*np.where(variances > SMALLEST_SD**2, np.sqrt(variances), 0.0).tolist()), top

    @cached_property
    def _searched(self) -> tuple[FloatArray, float]:
        """The variances of repeats, samples and sweeps (3,) of the highest likelihood, and how high it is."""
        self.check()
        if not self.is_crossed:
            raise ValueError(f"{NOT_CROSSED}: the noise between sweeps cannot be told; {ONE_NUMBER}")
        within = float(self.scatter.sum()) / (self.samples - self.repeats)
        return _highest(self, within * np.array(START), _bounds())

    def profile(self, name: str, sd: float) -> float:
        """Return the highest log likelihood with one component given."""
        bounds = _bounds()
        bounds[self.names.index(name)] = sd**2
        return _highest(self, np.clip(self._searched[0], *bounds.T), bounds)[1]


def levels_by(repeats: Repeats, samples: Samples, accepted: BoolArray) -> RepeatLevels:
    """Reduce the accepted samples (N,) of one recording to its repeats, as the cohort says that they are."""
    kind = SweepLevels if repeats == "sweeps" else RepeatLevels
    return kind.of(samples, accepted)


def _likelihood(levels: SweepLevels, variance: FloatArray) -> tuple[float, FloatArray]:
    """Return the restricted log likelihood, but for a constant, and its derivatives by the variances; (3,).

    The variances (3,) are of repeats, samples (above zero) and sweeps; without noise between sweeps the
    likelihood is that of separate repeats. Tables are of n recordings, P phases and K sweeps.

    With P = V^-1 - V^-1 X (X^T V^-1 X)^-1 X^T V^-1 the derivative by a variance whose part of V is V_k is
    -1/2 [tr(P V_k) - y^T P V_k P y] (Searle, Casella and McCulloch 1992, Sec. 6.6).
    """
    repeat, sample, sweep = variance
    scatter, freedom = levels.scatter.sum(), levels.samples - levels.repeats
    precision = 1.0 / (repeat + sample / levels.size)
    weight, mean = levels.table(precision), levels.table(levels.mean)  # (n, P, K)
    total = weight.sum(axis=2, keepdims=True)
    share = weight / np.where(total > 0.0, total, 1.0)
    deviation = mean - (share * mean).sum(axis=2, keepdims=True)
    diagonal = weight.sum(axis=1)[:, :, None] * np.eye(weight.shape[2])
    information = diagonal - weight.transpose(0, 2, 1) @ share  # A, (n, K, K)
    seen = (weight * deviation).sum(axis=1)  # b, (n, K)
    inverse = np.linalg.inv(np.eye(seen.shape[1]) + sweep * information)
    effect = (inverse @ seen[:, :, None])[:, :, 0]  # what a sweep is predicted to add, over s_swp^2

    within = freedom * np.log(sample) + scatter / sample
    separate = np.log(total[total > 0.0]).sum() - np.log(precision).sum()
    separate += (weight * deviation**2).sum()
    crossed = -np.linalg.slogdet(inverse)[1].sum() - sweep * (seen * effect).sum()
    likelihood = -0.5 * float(within + separate + crossed)

    spread = share @ inverse
    reduction = np.diagonal(inverse, axis1=1, axis2=2)[:, None] - 2.0 * spread
    reduction = reduction + (spread * share).sum(axis=2, keepdims=True)
    trace = (weight * (1.0 - share) - sweep * weight**2 * reduction)[levels.place]
    own = effect[:, None] - (share * effect[:, None]).sum(axis=2, keepdims=True)
    residual = (weight * (deviation - sweep * own))[levels.place]
    by_repeat = -0.5 * (trace - residual**2)
    by_sample = float((by_repeat / levels.size).sum()) - 0.5 * (freedom / sample - scatter / sample**2)
    by_sweep = -0.5 * ((inverse * information).sum() - (effect**2).sum())
    return likelihood, np.array([by_repeat.sum(), by_sample, by_sweep])


def _bounds() -> FloatArray:
    lowest = np.where(np.arange(3) == SAMPLE, SMALLEST_SD**2, 0.0)
    return np.stack([lowest, np.full(3, LARGEST_SD**2)], axis=1)


def _highest(levels: SweepLevels, start: FloatArray, bounds: FloatArray) -> tuple[FloatArray, float]:
    """Return the variances (3,) within ``bounds`` (3, 2) at which the likelihood is highest, and how high."""
    from scipy.optimize import Bounds, minimize

    # The search is over variances, which reach zero, and not over their logs, which do not. Where the
    # likelihood is steep along one of them it may stop short; it begins anew there until it rises no more.
    unit = float(levels.scatter.sum()) / (levels.samples - levels.repeats)
    at, top = start, -np.inf
    for _ in range(MAX_SEARCHES):
        found = minimize(
            partial(_falling, levels, unit),
            at / unit,
            jac=True,
            method="L-BFGS-B",
            bounds=Bounds(*(bounds / unit).T),
            options={"ftol": 1e-15, "gtol": 1e-7, "maxiter": 500},  # as far as numbers carry
        )
        before, at, top = top, unit * np.asarray(found.x), -float(found.fun)
        if np.isclose(top, before, rtol=RELATIVE_RISE, atol=TOLERANCE):
            return at, top
    raise RuntimeError(f"no maximum of the likelihood in {MAX_SEARCHES} searches, the last to variances {at}")


def _falling(levels: SweepLevels, unit: float, relative: FloatArray) -> tuple[float, FloatArray]:
    likelihood, slope = _likelihood(levels, unit * relative)
    return -likelihood, -unit * slope
