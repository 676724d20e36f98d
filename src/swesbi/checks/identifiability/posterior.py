"""What the draws of a posterior tell: how far a recording narrows the prior, and what it leaves together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swesbi.base.arrays import FloatArray


@dataclass(frozen=True)
class Contraction:
    """1 - posterior variance / prior variance of q quantities, themselves and their logarithms; (q,) each.

    One: the recording tells the quantity exactly. Zero: it tells nothing. Negative: the posterior is wider
    than the prior, which happens for a value far out in a skewed prior.
    """

    linear: FloatArray
    logarithm: FloatArray


def contraction(draws: FloatArray, prior_draws: FloatArray) -> Contraction:
    """Compare posterior draws (n, q) of positive quantities with prior draws (m, q)."""
    return Contraction(
        1.0 - draws.var(axis=0) / prior_draws.var(axis=0),
        1.0 - np.log(draws).var(axis=0) / np.log(prior_draws).var(axis=0),
    )


def log_correlations(draws: FloatArray, parameters: FloatArray) -> FloatArray:
    """Return correlations (q, d) of the logarithms of quantities (n, q) and parameters (n, d)."""
    quantities = draws.shape[1]
    together = np.corrcoef(np.log(draws), np.log(parameters), rowvar=False)
    return np.asarray(together[:quantities, quantities:])
