"""How well predictive curves describe an observed one: by scores of the curve, and by features."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from swesbi.artefacts import Part, Variable
from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.draws import median_and_interval


@dataclass(frozen=True)
class Band:
    """The pointwise median and central interval of predictive curves, each of shape (points,)."""

    median: Annotated[FloatArray, Variable("", "", "predictive median{noise}")]
    low: Annotated[FloatArray, Variable("", "", "lower end of the predictive interval")]
    high: Annotated[FloatArray, Variable("", "", "upper end of the predictive interval")]


@dataclass(frozen=True)
class Scores:
    """Scores of one predictive distribution against one observed curve (paper, Sec. 2.5).

    All NaN where there is no prediction.
    """

    rmse_kpa: Annotated[float, Variable("", "kPa", "RMSE of the median {at}")]
    nrmse: Annotated[float, Variable("", "1", "RMSE over the observed range, {at}")]
    r2: Annotated[float, Variable("", "1", "coefficient of determination {at}")]
    post_peak_rmse_kpa: Annotated[float, Variable("", "kPa", "RMSE from the observed peak on, {after}")]
    coverage: Annotated[float, Variable("", "1", "fraction of the {points} inside the interval")]


NO_SCORES = Scores(*[float("nan")] * 5)


def band(values: FloatArray, interval: float) -> Band:
    """Summarise draws of shape (n, points) by their median and central interval; NaN where n is 0."""
    if len(values) == 0:
        empty = np.full(values.shape[1], np.nan)
        return Band(empty, empty, empty)
    low, median, high = median_and_interval(values, interval)
    return Band(median, low, high)


def score(phase: FloatArray, observed: FloatArray, predicted: Band) -> Scores:
    """Score a predictive band against an observed curve at the same phases, all of shape (points,).

    Post-peak means from the observed peak to the end of the cycle. An observed curve must be finite and vary.
    """
    if not np.all(np.isfinite(observed)) or np.ptp(observed) == 0.0:
        raise ValueError(f"the observed curve must be finite and vary, found {observed.tolist()}")
    if np.isnan(predicted.median).any():
        return NO_SCORES
    after = phase >= phase[np.argmax(observed)]
    error = rmse(observed, predicted.median)
    return Scores(
        rmse_kpa=error,
        nrmse=error / float(np.ptp(observed)),
        r2=r2(observed, predicted.median),
        post_peak_rmse_kpa=rmse(observed[after], predicted.median[after]),
        coverage=coverage(observed, predicted),
    )


def rmse(observed: FloatArray, predicted: FloatArray) -> float:
    """Return the root mean squared error, in the unit of the values."""
    return float(np.sqrt(np.mean((observed - predicted) ** 2)))


def r2(observed: FloatArray, predicted: FloatArray) -> float:
    """Return the coefficient of determination, 1 - residual over total sum of squares."""
    residual = np.sum((observed - predicted) ** 2)
    return float(1.0 - residual / np.sum((observed - observed.mean()) ** 2))


def coverage(observed: FloatArray, predicted: Band) -> float:
    """Return the fraction of observed values inside the interval, its ends included."""
    return float(np.mean((observed >= predicted.low) & (observed <= predicted.high)))


def reduction_percent(rmse_before: float, rmse_after: float) -> float:
    """Return by how many percent the error fell."""
    return 100.0 * (1.0 - rmse_after / rmse_before)


@dataclass(frozen=True)
class FeatureCheck:
    """Observed features beside their predictive medians and intervals, each of shape (features,).

    The interval is that of a new observation: simulated feature plus the observation noise of its
    component. NaN where there is no prediction.
    """

    observed: FloatArray
    predicted: Annotated[Band, Part("feature_{}", "feature", words={"noise": ", noise included"})]

    @property
    def inside(self) -> BoolArray:
        """Which observed features lie inside their interval; False where there is no prediction."""
        return np.asarray((self.observed >= self.predicted.low) & (self.observed <= self.predicted.high))


@dataclass(frozen=True)
class Coverages:
    """Fractions of one observed curve inside three intervals of its prediction; NaN without draws.

    "Predictive interval" may mean two things. The band of noiseless curves says where the simulator's curves
    lie under the draws; the interval under the observation model says where a new recording of them would.
    The envelope of the noiseless curves is the ceiling of the first: no interval of the same draws contains
    more.
    """

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
    """Count the observed values (points,) inside each interval of noiseless and noisy draws (n, points)."""
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
