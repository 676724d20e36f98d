"""A heart of another generator: its context, its true total stiffness, and the truths that are asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.parameters import THETA_NAMES
from swesbi.recording.acquisition import TruthCurve

K_SR: Final = THETA_NAMES.index("k_sr_per_s")


@dataclass(frozen=True)
class OtherHeart:
    """One heart before it is recorded; theta, k_SR and isometric stiffness are None where its law has none.

    The curve is the noiseless total stiffness, as an infinitely good acquisition would measure it;
    ``active_kpa`` (M,) is its active part that elastography shows. ``volume_ratio`` is end-systolic over
    end-diastolic volume.
    """

    context: Context
    curve: TruthCurve
    theta: FloatArray | None
    k_sr_per_s: float | None
    active_kpa: FloatArray
    isometric_kpa: float | None
    volume_ratio: float

    def __post_init__(self) -> None:
        """Refuse a heart whose truths contradict each other, or are no stiffness."""
        name = self.context.subject
        if not (np.isfinite(self.active_kpa).all() and self.peak_active_kpa > 0.0):
            raise ValueError(
                f"{name}: peak_active_kpa = {self.peak_active_kpa}: must be a positive stiffness"
            )
        if not 0.0 < self.volume_ratio < 1.0:
            raise ValueError(f"{name}: volume_ratio = {self.volume_ratio}: must lie between 0 and 1")
        if not (self.curve.stiffness_kpa > 0.0).all():
            raise ValueError(f"{name}: the total stiffness is not positive throughout the cycle")
        if self.theta is None:
            return
        if self.theta.shape != (len(THETA_NAMES),):
            raise ValueError(f"{name}: theta has shape {self.theta.shape}, not ({len(THETA_NAMES)},)")
        if self.k_sr_per_s != float(self.theta[K_SR]):
            raise ValueError(f"{name}: k_sr_per_s = {self.k_sr_per_s} is not that of theta {self.theta}")

    @property
    def peak_active_kpa(self) -> float:
        """Largest true active stiffness that elastography shows."""
        return float(self.active_kpa.max())
