"""Posterior contraction: by how much the recording narrows the prior."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from swesbi.artefacts import Variable
from swesbi.identifiability.quantities import quantities
from swesbi.prior import BoxPrior, quantile

FloatArray = NDArray[np.float64]
SOBOL_POWER: Final = 16


@dataclass(frozen=True)
class Contraction:
    """1 - posterior variance / prior variance of q quantities, themselves and their logarithms; (q,) each.

    One: the recording tells the quantity exactly. Zero: it tells nothing. Negative: the posterior is wider
    than the prior, which happens for a value far out in a skewed prior.
    """

    linear: Annotated[
        FloatArray, Variable("quantity", "1", "1 - posterior variance / prior variance", "contraction")
    ]
    logarithm: Annotated[FloatArray, Variable("quantity", "1", "the same of the log", "contraction_log")]


def contraction(draws: FloatArray, prior_draws: FloatArray) -> Contraction:
    """Compare posterior draws (n, q) of positive quantities with prior draws (m, q)."""
    return Contraction(
        1.0 - draws.var(axis=0) / prior_draws.var(axis=0),
        1.0 - np.log(draws).var(axis=0) / np.log(prior_draws).var(axis=0),
    )


def prior_quantities(prior: BoxPrior, duration_s: float) -> FloatArray:
    """Return the quantities of 2^16 points spread over the prior by a Sobol sequence, (65536, 5)."""
    points = qmc.Sobol(d=len(prior.parameters), scramble=False).random_base2(SOBOL_POWER)
    return quantities(quantile(points + 0.5 / 2**SOBOL_POWER, prior), duration_s)
