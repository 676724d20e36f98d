"""Where the truth lies among the draws of a posterior, equally weighted or not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.exact.weights import effective_draws

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Moments:
    """Weighted mean and standard deviation of q quantities; shape (q,) each."""

    mean: FloatArray
    sd: FloatArray


def level_of_truth(truth: FloatArray, draws: FloatArray, weight: FloatArray) -> FloatArray:
    """Return the mid-rank of the truth among n draws as a level in (0, 1); shape (q,).

    For L equal weights the truth's rank r among the draws is uniform on 0..L if the posterior is right
    (Talts et al. 2018, Validating Bayesian inference algorithms with simulation-based calibration), and the
    level is (r + 1/2) / (L + 1). For unequal weights r is L times the weight below the truth, with L the
    effective number of draws. Ties count by half.

    Args:
        truth: True values; shape (q,).
        draws: Posterior draws; shape (n, q).
        weight: Normalised weights; shape (n,).
    """
    below = weight @ (draws < truth) + 0.5 * (weight @ (draws == truth))
    number = effective_draws(weight)
    return np.asarray((number * below + 0.5) / (number + 1.0))


def central_level(level: FloatArray) -> FloatArray:
    """Return |2 u - 1| for levels u: the mass of the smallest central interval that holds the truth.

    Its distribution function at a nominal level is the coverage of the equal-tailed interval of that mass.
    """
    return np.abs(2.0 * level - 1.0)


def moments(draws: FloatArray, weight: FloatArray) -> Moments:
    """Return the weighted moments of draws (n, q) that carry weight; others may hold anything."""
    used = weight > 0.0
    kept, share = draws[used], weight[used]
    mean = share @ kept
    return Moments(mean, np.sqrt(share @ (kept - mean) ** 2))
