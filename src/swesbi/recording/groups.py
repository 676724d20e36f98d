"""Samples and repeats in groups: of one phase, or of one repeat of it; their sums, means and medians."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swesbi.base.arrays import FloatArray, IntArray


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
