"""The prior of what has changed: of the ratio of theta at two visits, each of which has the prior of theta.

Of theta no part is shared between the visits of a person, so log theta at both is independent under the
prior: normal about m with standard deviation s, truncated to [l, h]. Their difference delta then has the
density of the convolution, with Z the mass between the bounds and phi, Phi of the standard normal::

    pi(delta) = phi(delta / (sqrt(2) s)) / (sqrt(2) s)
                (Phi((u - c) sqrt(2) / s) - Phi((d - c) sqrt(2) / s)) / Z^2,

where log theta of the later visit lies between d = max(l, l + delta) and u = min(h, h + delta), about
c = m + delta / 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import log_ndtr

from swesbi.base.arrays import FloatArray
from swesbi.prior import BoxPrior, ParameterPrior, PriorSettings, in_bounds
from swesbi.prior import log_density as log_density_of_box

ROOT_TWO: Final = float(np.sqrt(2.0))
LOG_ROOT_TWO_PI: Final = 0.5 * float(np.log(2.0 * np.pi))


@dataclass(frozen=True)
class RatioPrior:
    """The prior of the ratio of theta at two visits.

    Attributes:
        theta: The prior of theta at each of them.
    """

    theta: PriorSettings

    @property
    def parameters(self) -> tuple[ParameterPrior, ...]:
        """Bounds of each ratio, with centre and standard deviation of it before truncation."""
        return tuple(
            ParameterPrior(
                centre=1.0,
                log_sd=ROOT_TWO * each.log_sd,
                low=each.low / each.high,
                high=each.high / each.low,
            )
            for each in self.theta.parameters
        )

    def log_density(self, ratio: FloatArray) -> FloatArray:
        """Return log p(ratio), per unit of the ratio, of ratios (n, 3); -inf outside the bounds; (n,)."""
        inside = in_bounds(ratio, self)
        log_ratio = np.log(np.where(inside[:, None], ratio, 1.0))
        terms = [
            _log_density_of_difference(log_ratio[:, j], each) - log_ratio[:, j]
            for j, each in enumerate(self.theta.parameters)
        ]
        return np.where(inside, np.sum(terms, axis=0), -np.inf)


def _log_density_of_difference(delta: FloatArray, of_visit: ParameterPrior) -> FloatArray:
    """Return log pi(delta) of log ratios (n,) within the bounds; shape (n,)."""
    mean, sd = np.log(of_visit.centre), of_visit.log_sd
    low, high = np.log([of_visit.low, of_visit.high])
    about = mean + 0.5 * delta
    least, most = np.maximum(low, low + delta), np.minimum(high, high + delta)
    both = log_normal_mass((least - about) * ROOT_TWO / sd, (most - about) * ROOT_TWO / sd)
    each = log_normal_mass(np.array((low - mean) / sd), np.array((high - mean) / sd))
    width = ROOT_TWO * sd
    return np.asarray(-0.5 * (delta / width) ** 2 - np.log(width) - LOG_ROOT_TWO_PI + both - 2.0 * each)


def log_density(values: FloatArray, prior: BoxPrior | RatioPrior) -> FloatArray:
    """Return the log density, per unit of each value, of values (n, 3) under either prior; shape (n,)."""
    if isinstance(prior, RatioPrior):
        return prior.log_density(values)
    return log_density_of_box(values, prior)


def log_normal_mass(low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the log probability of a standard normal variable between limits, however far off they lie."""
    flipped = low > 0.0  # the upper tail is the lower one of minus the variable
    below, above = np.where(flipped, -high, low), np.where(flipped, -low, high)
    log_above = log_ndtr(above)
    with np.errstate(divide="ignore"):  # at the ends of the ratio's support both limits are one
        return np.asarray(log_above + np.log1p(-np.exp(log_ndtr(below) - log_above)))
