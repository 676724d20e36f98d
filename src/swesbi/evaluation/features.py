"""Are the observed features inside their predictive intervals?"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import Part
from swesbi.evaluation.scores import Band, band

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class FeatureCheck:
    """Observed features beside their predictive medians and intervals, each of shape (features,).

    The interval is that of a new observation: simulated feature plus the observation noise of its
    component. NaN where there is no prediction.
    """

    observed: FloatArray
    predicted: Annotated[Band, Part("feature_{}", "feature", words={"noise": ", noise included"})]

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Which observed features lie inside their interval; False where there is no prediction."""
        inside: NDArray[np.bool_] = (self.observed >= self.predicted.low) & (
            self.observed <= self.predicted.high
        )
        return inside


def check_features(
    observed: FloatArray,
    simulated: FloatArray,
    noise_sd: FloatArray,
    interval: float,
    rng: np.random.Generator,
) -> FeatureCheck:
    """Compare observed features with the predictive distribution of a new observation.

    The noise is the additive Gaussian of the observation model (paper, Eq. 5).

    Args:
        observed: (features,) features of the observed curve.
        simulated: (n, features) features of the predictive curves, same units.
        noise_sd: (features,) standard deviation of the observation noise, same units.
        interval: Probability mass of the central interval.
        rng: Draws the noise.
    """
    noise = rng.standard_normal(simulated.shape) * noise_sd
    return FeatureCheck(observed, band(simulated + noise, interval))
