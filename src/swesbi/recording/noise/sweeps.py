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
from swesbi.recording.groups import grouped
from swesbi.recording.noise.components import LARGEST_SD, SMALLEST_SD, TOLERANCE, RepeatLevels
from swesbi.recording.samples import Samples
from swesbi.recording.settings import Repeats
from swesbi.recording.speed import NoiseComponents, repeat_means

SAMPLE, SWEEP = 1, 2  # places among the components
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
        """Return the restricted log likelihood of components, but for a constant.

        Without noise between sweeps it is that of separate repeats.
        """
        repeat, sample, sweep = vars(noise).values()
        return _Model(self, (repeat**2, sample**2, sweep**2)).log_likelihood()

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


@dataclass(frozen=True)
class _Model:
    """The restricted likelihood at given variances, over tables of n recordings, P phases and K sweeps.

    The variances are of repeats, samples (above zero) and sweeps.
    """

    levels: SweepLevels
    variance: tuple[float, float, float]

    @property
    def freedom(self) -> int:
        """Degrees of freedom within repeats."""
        return self.levels.samples - self.levels.repeats

    @cached_property
    def place(self) -> tuple[IntArray, IntArray, IntArray]:
        """Recording, phase and sweep of each repeat, its place in the tables."""
        recording, cell = self.levels.recording, self.levels.cell
        first = np.full(int(recording.max()) + 1, self.levels.cells)
        np.minimum.at(first, recording, cell)
        return recording, cell - first[recording], self.levels.sweep

    def table(self, values: FloatArray) -> FloatArray:
        """Return values of the repeats as a table, zero where there is none; shape (n, P, K)."""
        table = np.zeros([int(index.max()) + 1 for index in self.place])
        table[self.place] = values
        return table

    @cached_property
    def precision(self) -> FloatArray:
        """Weight w of each repeat; shape (R,)."""
        repeat, sample, _ = self.variance
        return 1.0 / (repeat + sample / self.levels.size)

    @cached_property
    def weight(self) -> FloatArray:
        """Weights w; shape (n, P, K)."""
        return self.table(self.precision)

    @cached_property
    def share(self) -> FloatArray:
        """Share of each repeat in its cell's mean; shape (n, P, K)."""
        total = self.weight.sum(axis=2, keepdims=True)
        return self.weight / np.where(total > 0.0, total, 1.0)

    @cached_property
    def deviation(self) -> FloatArray:
        """m_ir - m_i; shape (n, P, K)."""
        mean = self.table(self.levels.mean)
        return np.asarray(mean - (self.share * mean).sum(axis=2, keepdims=True))

    @cached_property
    def information(self) -> FloatArray:
        """A; shape (n, K, K)."""
        diagonal = self.weight.sum(axis=1)[:, :, None] * np.eye(self.weight.shape[2])
        return np.asarray(diagonal - self.weight.transpose(0, 2, 1) @ self.share)

    @cached_property
    def seen(self) -> FloatArray:
        """b; shape (n, K)."""
        return np.asarray((self.weight * self.deviation).sum(axis=1))

    @cached_property
    def inverse(self) -> FloatArray:
        """(I + s_swp^2 A)^-1; shape (n, K, K)."""
        whole = np.eye(self.seen.shape[1]) + self.variance[SWEEP] * self.information
        return np.asarray(np.linalg.inv(whole), dtype=np.float64)

    @cached_property
    def effect(self) -> FloatArray:
        """(I + s_swp^2 A)^-1 b, what a sweep is predicted to add, over s_swp^2; shape (n, K)."""
        return np.asarray((self.inverse @ self.seen[:, :, None])[:, :, 0])

    def log_likelihood(self) -> float:
        """Return the restricted log likelihood, but for a constant; at s_swp = 0 that of separate repeats."""
        total = self.weight.sum(axis=2)
        within = self.freedom * np.log(self.variance[SAMPLE]) + (
            self.levels.scatter.sum() / self.variance[SAMPLE]
        )
        separate = np.log(total[total > 0.0]).sum() - np.log(self.precision).sum()
        separate += (self.weight * self.deviation**2).sum()
        crossed = -np.linalg.slogdet(self.inverse)[1].sum()
        crossed -= self.variance[SWEEP] * (self.seen * self.effect).sum()
        return -0.5 * float(within + separate + crossed)

    def slope(self) -> FloatArray:
        """Return its derivatives by the variances; shape (3,).

        With P = V^-1 - V^-1 X (X^T V^-1 X)^-1 X^T V^-1 the derivative by a variance whose part of V is V_k is
        -1/2 [tr(P V_k) - y^T P V_k P y] (Searle, Casella and McCulloch 1992, Sec. 6.6).
        """
        sweep, sample = self.variance[SWEEP], self.variance[SAMPLE]
        spread = self.share @ self.inverse
        diagonal = np.diagonal(self.inverse, axis1=1, axis2=2)[:, None]
        reduction = diagonal - 2.0 * spread + (spread * self.share).sum(axis=2, keepdims=True)
        trace = (self.weight * (1.0 - self.share) - sweep * self.weight**2 * reduction)[self.place]
        effect = self.effect[:, None] - (self.share * self.effect[:, None]).sum(axis=2, keepdims=True)
        residual = (self.weight * (self.deviation - sweep * effect))[self.place]
        by_repeat = -0.5 * (trace - residual**2)
        within = -0.5 * (self.freedom / sample - self.levels.scatter.sum() / sample**2)
        by_sweep = -0.5 * ((self.inverse * self.information).sum() - (self.effect**2).sum())
        by_sample = float((by_repeat / self.levels.size).sum()) + within
        return np.array([by_repeat.sum(), by_sample, by_sweep])


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
    repeat, sample, sweep = unit * relative
    model = _Model(levels, (float(repeat), float(sample), float(sweep)))
    return -model.log_likelihood(), -unit * model.slope()
