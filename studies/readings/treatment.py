"""Curves as a reading treats them before S(.): smoothed, aligned, noisy as a whole."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.ndimage import gaussian_filter1d

from studies.readings.settings import Treatment
from swesbi.base.arrays import FloatArray
from swesbi.checks.observed_curves import (
    SCALED_BY,
    SHIFTED_BY,
    observed_curves,
    shift_cycles,
)
from swesbi.measurement.settings import SCALAR_NAMES, SummarySettings
from swesbi.measurement.summary import summarise
from swesbi.networks.settings import ObservationModelSettings

ALIGNED_PEAK: Final = 0.4
"""Phase to which the peaks of aligned curves are shifted (chosen: about where they are)."""
TIME_TO_PEAK: Final = SCALAR_NAMES.index("time_to_peak_cycle")


def smooth_cycle(curves_kpa: FloatArray, sd_cycle: float) -> FloatArray:
    """Return curves (n, G), the last value equal to the first, under a Gaussian kernel around the cycle."""
    if sd_cycle == 0.0:
        return curves_kpa
    steps = curves_kpa.shape[1] - 1
    smooth = gaussian_filter1d(curves_kpa[:, :-1], sd_cycle * steps, axis=1, mode="wrap")
    return np.concatenate([smooth, smooth[:, :1]], axis=1)


@dataclass(frozen=True)
class Features:
    """The features of curves as a reading takes them, and the noise on them.

    Attributes:
        summary: The summary operator S(.).
        treatment: The reading.
        observation_model: Noise on features (paper, Eq. 5).
    """

    summary: SummarySettings
    treatment: Treatment
    observation_model: ObservationModelSettings

    def of(self, curves_kpa: FloatArray) -> FloatArray:
        """Return the features (n, F) of curves (n, G).

        Aligned, the scalars are of the curve as it is, time to peak among them, and the trajectory values of
        the curve shifted around the cycle until its peak, as S(.) finds it, lies at ``ALIGNED_PEAK``.
        """
        before = self.treatment.smoothing_cycle if self.treatment.smoothed == "features" else 0.0
        curves = smooth_cycle(curves_kpa, before)
        features = summarise(curves, self.summary)
        if self.treatment.aligned:
            moved = shift_cycles(curves, ALIGNED_PEAK - features[:, TIME_TO_PEAK])
            features[:, len(SCALAR_NAMES) :] = summarise(moved, self.summary)[:, len(SCALAR_NAMES) :]
        return features

    @property
    def on_features(self) -> dict[str, float]:
        """The noise that is added to features: what does not act on whole curves."""
        sd = self.observation_model.feature_noise_sd
        if not self.treatment.curve_noise:
            return dict(sd)
        return {name: value for name, value in sd.items() if name not in (SCALED_BY, SHIFTED_BY)}

    def observed(self, curves_kpa: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return the features of curves under the noise on whole curves, without that on features."""
        if not self.treatment.curve_noise:
            return self.of(curves_kpa)
        return self.of(observed_curves(curves_kpa, self.observation_model.feature_noise_sd, rng))
