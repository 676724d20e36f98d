"""What a posterior owes to its prior and to its likelihood, by scaling the power of either.

Draws are weighted by density^(alpha - 1), for alpha = 1.25 and 1 / 1.25, and the weights Pareto-smoothed:
so the posterior of a prior, or a likelihood, to the power of alpha needs no further draw. How far it lies
from the posterior is told, of each quantity, by the cumulative Jensen-Shannon distance. With distribution
functions P and Q over the range of the draws, and M = (P + Q) / 2,

    distance^2 = int [P log2(P / M) + Q log2(Q / M)] dx / int (P + Q) dx,

of x or of -x, whichever is larger. The sensitivity is the distance per unit of log2 alpha (Kallioinen,
Paananen, Buerkner and Vehtari, Stat Comput 34:57, 2024, Sec. 2).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import rel_entr

from swesbi.base.arrays import FloatArray
from swesbi.checks.calibration.ranks import standardised
from swesbi.parameters import OF_INTEREST
from swesbi.posterior.diagnostics import smooth
from swesbi.prior import BoxPrior

ALPHA: Final = 1.25
SENSITIVE: Final = 0.05
"""From here on a posterior is taken to depend on what is scaled (Kallioinen et al. 2024, Sec. 2.3)."""


@dataclass(frozen=True)
class Sensitivity:
    """How q quantities depend on one part of the posterior.

    ``distance`` (q,) is the cumulative Jensen-Shannon distance per unit of log2 alpha; ``k_hat`` the larger
    Pareto shape of the weights of both powers, reliable below 0.7.
    """

    distance: FloatArray
    k_hat: float


def sensitivity(values: FloatArray, log_density: FloatArray) -> Sensitivity:
    """Scale a part of a posterior, its log density (n,), in power, by equal draws (n, q) of quantities."""
    scaled = [smooth((alpha - 1.0) * log_density) for alpha in (ALPHA, 1.0 / ALPHA)]
    moved = [[cumulative_distance(each, np.exp(log_weight)) for each in values.T] for log_weight, _ in scaled]
    return Sensitivity(np.mean(moved, axis=0) / np.log2(ALPHA), max(k_hat for _, k_hat in scaled))


def cumulative_distance(values: FloatArray, weight: FloatArray) -> float:
    """Return the cumulative Jensen-Shannon distance that weights (n,), whose sum is one, move draws (n,)."""
    return max(_distance(values, weight), _distance(-values, weight))


def _distance(values: FloatArray, weight: FloatArray) -> float:
    order = np.argsort(values, kind="stable")
    width = np.diff(values[order])
    before, after = np.arange(1, len(values)) / len(values), np.cumsum(weight[order])[:-1]
    middle = 0.5 * (before + after)
    apart = width @ (rel_entr(before, middle) + rel_entr(after, middle)) / np.log(2.0)
    whole = width @ (before + after)
    return float(np.sqrt(max(apart, 0.0) / whole)) if whole > 0.0 else 0.0  # rounding may leave it below 0


def parts_of_posterior(
    phi: FloatArray, prior: BoxPrior, log_likelihood: FloatArray
) -> Mapping[str, FloatArray]:
    """Return the logarithms of what a posterior is made of, up to constants, by name; (n,) each.

    The prior is scaled as a density of log phi, which is normal within its bounds: a power narrows it about
    its centre, and leaves the bounds. Nuisance parameters are many, and shift the posterior against the
    parameters of interest, so that both together would look like nothing.
    """
    of_each = -0.5 * standardised(phi, prior) ** 2
    return {
        "prior": of_each[:, OF_INTEREST].sum(axis=1),
        "nuisances": of_each[:, OF_INTEREST.stop :].sum(axis=1),
        "likelihood": log_likelihood,
    }
