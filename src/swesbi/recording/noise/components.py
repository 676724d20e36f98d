"""Variance components of repeated speeds: a nested mixed model, fitted by restricted maximum likelihood.

The log speed of sample j of repeat r in cell i (one phase of one subject) is

    y_irj = mu_i + u_ir + e_irj,    u_ir ~ N(0, s_rep^2),    e_irj ~ N(0, s_sam^2),

a mixed model with fixed cells, random repeats and any numbers of repeats and samples. Since repeats lie
within cells, the restricted likelihood (Patterson and Thompson 1971, Biometrika 58:545) falls apart into
sums over repeats and cells, and needs no matrix: a library's general solver holds one column a cell.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Annotated, ClassVar, Final, Self

import numpy as np
from scipy.special import chdtri

from swesbi.artefacts import Variable
from swesbi.base.arrays import BoolArray, FloatArray, IntArray, below_each_other
from swesbi.recording.samples import Samples, grouped
from swesbi.recording.speed import NoiseComponents, phase_trend, repeat_means

LARGEST_SD: Final = 2.0  # of a log speed, far beyond any measurement
SMALLEST_SD: Final = 1e-4
TOLERANCE: Final = 1e-6
STEP: Final = 0.02  # relative, of the second difference behind the standard error


@dataclass(frozen=True)
class ComponentEstimate:
    """One variance component as a relative standard deviation of the speed, estimated by REML.

    The standard error is from the curvature of the profile likelihood; the lower limit is 0 where zero is
    within the interval, the upper one ``LARGEST_SD`` where that is.
    """

    fraction: Annotated[float, Variable("", "1", "relative standard deviation of the speed, {whose}")]
    standard_error: Annotated[float, Variable("", "1", "its standard error{none}")]
    low: Annotated[float, Variable("", "1", "lower limit of its {kind}interval")]
    high: Annotated[float, Variable("", "1", "upper limit")]


@dataclass(frozen=True)
class RepeatLevels:
    """The repeats of one or more recordings, R of them; with the cells they are sufficient statistics.

    ``cell`` is subject and phase as a number from 0, without gaps, ``size`` the accepted samples, ``mean``
    that of their log speeds (c in m/s), the trend of the repeat's beat taken out, ``scatter`` the sum of
    squared deviations of log speeds from their mean; each of shape (R,).
    """

    names: ClassVar[tuple[str, ...]] = ("repeat", "sample")
    """What the components are between, in their order."""
    cell: IntArray
    size: IntArray
    mean: FloatArray
    scatter: FloatArray

    @classmethod
    def of(cls, samples: Samples, accepted: BoolArray) -> Self:
        """Reduce the accepted samples (N,) of one recording to its repeats.

        Repeats at one delay fall into beats of different RR, so at slightly different phases. What they
        differ by on the slope of the curve is no error, since the phase is averaged like the speed; it is
        taken out (:func:`swesbi.recording.speed.phase_trend`).
        """
        repeats = repeat_means(samples, accepted)
        groups = grouped(samples.phase_index[accepted], samples.repeat[accepted])
        log_speed = np.log(samples.speed_m_s[accepted])
        mean = groups.means(log_speed) - np.log1p(phase_trend(repeats))
        return cls(repeats.phases.of, repeats.size, mean, groups.scatter(log_speed))

    @classmethod
    def joined(cls, recordings: Sequence[Self]) -> Self:
        """Join recordings; no two share a cell."""
        first = np.cumsum([0, *(levels.cells for levels in recordings)])
        apart = [replace(own, cell=own.cell + n) for own, n in zip(recordings, first, strict=False)]
        return below_each_other(apart)

    @property
    def samples(self) -> int:
        """Number of accepted samples."""
        return int(self.size.sum())

    @property
    def repeats(self) -> int:
        """Number of repeats R."""
        return len(self.size)

    @property
    def cells(self) -> int:
        """Number of measured phases, over the recordings."""
        return int(self.cell.max(initial=-1)) + 1

    def check(self) -> None:
        """Raise a ``ValueError`` of repeats from which a component cannot be told."""
        if self.repeats <= self.cells:
            raise ValueError("no phase was measured twice: the noise between repeats cannot be told")
        if self.samples <= self.repeats:
            raise ValueError("no repeat has two accepted samples: the noise between samples cannot be told")
        if not self.scatter.sum() > 0:
            raise ValueError("all samples of a repeat are equal: the recordings hold no noise to estimate")

    def log_likelihood(self, noise: NoiseComponents) -> float:
        """Return the restricted log likelihood of components, but for a constant."""
        separate = noise.of_separate_repeats
        return log_restricted_likelihood(self, separate.repeat_fraction, separate.sample_fraction)

    @cached_property
    def maximum(self) -> tuple[NoiseComponents, float]:
        """The components of the highest likelihood, and how high it is; refused as of :meth:`check`."""
        self.check()
        repeat_sd, top = _highest(partial(self.profile, "repeat"))
        sample_sd, _ = _highest(partial(self.profile, "sample"))
        # The search is over log s_rep and cannot reach zero, where the maximum often lies: few repeats a cell
        if (at_zero := self.profile("repeat", 0.0)) >= top:
            repeat_sd, top = 0.0, at_zero
        return NoiseComponents(repeat_sd, sample_sd), top

    def profile(self, name: str, sd: float) -> float:
        """Return the highest log likelihood with one component given."""
        if name == "repeat":
            return _highest(lambda sample_sd: log_restricted_likelihood(self, sd, sample_sd))[1]
        return _highest(lambda repeat_sd: log_restricted_likelihood(self, repeat_sd, sd))[1]

    def estimates(self, interval: float) -> tuple[dict[str, ComponentEstimate], float]:
        """Return the components by name, with intervals of this mass, and the highest likelihood."""
        found, top = self.maximum
        drop = 0.5 * float(chdtri(1, 1.0 - interval))
        return {
            name: profile_estimate(partial(self.profile, name), getattr(found, f"{name}_fraction"), drop)
            for name in self.names
        }, top


def log_restricted_likelihood(levels: RepeatLevels, repeat_sd: float, sample_sd: float) -> float:
    """Return the restricted log likelihood, but for a constant; ``sample_sd`` is above zero.

    With v_r = s_rep^2 + s_sam^2 / n_r the variance of a repeat mean and w_r = 1 / v_r, it is

        -1/2 [(N - R) log s_sam^2 + S / s_sam^2 + sum_r log v_r + sum_i log sum_{r in i} w_r
              + sum_r w_r (m_r - m_i)^2]

    where S is the scatter within repeats, m_r the repeat means and m_i their weighted mean in the cell.
    """
    # Restricted: the cells' means are integrated out, which adds the term of ``of_cell``. The likelihood with
    # means fitted instead counts all repeats, though every cell spends one on its mean: too little noise.
    weight = 1.0 / (repeat_sd**2 + sample_sd**2 / levels.size)
    of_cell = np.bincount(levels.cell, weight)
    centre = np.bincount(levels.cell, weight * levels.mean) / of_cell
    between = float((weight * (levels.mean - centre[levels.cell]) ** 2).sum())
    within = (levels.samples - levels.repeats) * np.log(sample_sd**2) + levels.scatter.sum() / sample_sd**2
    return -0.5 * float(within - np.log(weight).sum() + np.log(of_cell).sum() + between)


def _highest(function: Callable[[float], float]) -> tuple[float, float]:
    """Return where a function of a standard deviation is highest, and how high; searched in the log."""
    from scipy.optimize import minimize_scalar

    minimum = minimize_scalar(
        lambda x: -function(float(np.exp(x))),
        bounds=(np.log(SMALLEST_SD), np.log(LARGEST_SD)),
        method="bounded",
        options={"xatol": TOLERANCE},
    )
    return float(np.exp(minimum.x)), float(-minimum.fun)


def profile_estimate(profile: Callable[[float], float], at: float, drop: float) -> ComponentEstimate:
    """Return a component with the interval in which its profile likelihood is at most ``drop`` below the top.

    ``profile`` is the log likelihood of a standard deviation, the other components chosen to make it highest;
    ``at`` is where it is highest, ``drop`` half the quantile of chi-squared with one degree of freedom.
    """
    from scipy.optimize import brentq

    top = profile(at)

    def above(sd: float) -> float:
        return profile(sd) - top + drop

    low = brentq(above, SMALLEST_SD, at) if at > SMALLEST_SD and above(SMALLEST_SD) < 0 else 0.0
    least = max(at, SMALLEST_SD)
    if above(least) <= 0:
        high = least  # less than can be distinguished from nothing
    else:
        high = brentq(above, least, LARGEST_SD) if above(LARGEST_SD) < 0 else LARGEST_SD
    return ComponentEstimate(at, _standard_error(profile, at, top), float(low), float(high))


def _standard_error(profile: Callable[[float], float], at: float, top: float) -> float:
    if at <= SMALLEST_SD:
        return float("nan")
    step = STEP * at
    curvature = (2.0 * top - profile(at + step) - profile(at - step)) / step**2
    return float(1.0 / np.sqrt(curvature)) if curvature > 0 else float("nan")
