"""How much of an observed curve a predictive distribution holds, by each reading of its interval.

"Predictive interval" may mean two things. The band of noiseless curves says where the simulator's curves
lie under the draws; the interval under the observation model says where a new recording of them would.
The envelope of the noiseless curves is the ceiling of the first: no interval of the same draws holds more.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from swesbi.artefacts import Variable
from swesbi.base.arrays import FloatArray
from swesbi.checks.scores import Band, band, coverage


@dataclass(frozen=True)
class Coverages:
    """Fractions of one observed curve inside three intervals of its prediction; NaN without draws."""

    noiseless: Annotated[
        float, Variable("", "1", "fraction of the {points} inside the interval of noiseless curves")
    ]
    observed: Annotated[
        float,
        Variable(
            "",
            "1",
            "fraction of the {points} inside the interval under the observation model, noise included",
        ),
    ]
    envelope: Annotated[
        float, Variable("", "1", "fraction of the {points} between the extremes of all noiseless curves")
    ]


NO_COVERAGES: Final = Coverages(*[float("nan")] * 3)


def cover(observed: FloatArray, noiseless: FloatArray, noisy: FloatArray, interval: float) -> Coverages:
    """Count the observed values (points,) inside each interval.

    Args:
        observed: The observed curve.
        noiseless: Curves of the draws, without noise; shape (n, points).
        noisy: The same draws as new observations would show them; shape (n, points).
        interval: Probability mass of the central intervals.
    """
    if len(noiseless) == 0:
        return NO_COVERAGES
    return Coverages(
        noiseless=coverage(observed, band(noiseless, interval)),
        observed=coverage(observed, band(noisy, interval)),
        envelope=coverage(observed, envelope(noiseless)),
    )


def envelope(curves: FloatArray) -> Band:
    """Return median and extremes of curves (n, points), n > 0."""
    return Band(np.median(curves, axis=0), curves.min(axis=0), curves.max(axis=0))
