"""How new recordings, noise and discrepancy included, meet the recording that was made."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from swesbi.evaluation.features import FeatureCheck
from swesbi.evaluation.new_recordings import NewRecordings
from swesbi.evaluation.predictive import Prediction, Target
from swesbi.evaluation.scores import NO_SCORES, Band, band, coverage, score

FloatArray = NDArray[np.float64]


def predict_recordings(made: NewRecordings, target: Target, interval: float) -> Prediction:
    """Compare predictive draws of an experiment on speeds with the observation.

    Medians are those of the noiseless curves, intervals those of new recordings: a measured phase should
    lie inside with the interval's probability. ``coverage_recording_noise`` is the coverage with measurement
    noise alone, the discrepancy left out.

    Args:
        made: n draws, n > 0.
        target: The observation.
        interval: Probability mass of the central intervals.
    """
    measured = target.measured
    curve = noisy_band(made.draws.curve_kpa, made.noisy.curve_kpa, interval)
    phases = noisy_band(made.draws.phase_kpa, made.noisy.phase_kpa, interval)
    observed = target.stiffness_kpa[measured]
    alone = band(made.measured.phase_kpa[:, measured], interval)
    return Prediction(
        draws=made.draws,
        curve=curve,
        phases=phases,
        features=FeatureCheck(target.features, band(made.noisy.features, interval)),
        scores=score(target.grid, target.curve_kpa, curve),
        phase_scores=score(target.phase[measured], observed, _at(phases, measured)),
        coverage_recording_noise=coverage(observed, alone),
    )


def noisy_band(noiseless: FloatArray, noisy: FloatArray, interval: float) -> Band:
    """Return the median of noiseless curves within the interval of noisy ones, (n, points) each."""
    ends = band(noisy, interval)
    return Band(band(noiseless, interval).median, ends.low, ends.high)


def withheld(prediction: Prediction) -> Prediction:
    """Return the prediction of a subject whose posterior is not reported: curves, but no scores."""
    return replace(
        prediction, scores=NO_SCORES, phase_scores=NO_SCORES, coverage_recording_noise=NO_SCORES.coverage
    )


def _at(values: Band, chosen: NDArray[np.bool_]) -> Band:
    return Band(values.median[chosen], values.low[chosen], values.high[chosen])
