"""The noise of the mean speeds of a design: what each has for itself, and what sweeps let all share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import IntArray
from swesbi.recording.speed import NoiseComponents


@dataclass(frozen=True)
class MeanNoise:
    """Squared relative errors of the mean speeds of a recording, the same at all phases.

    Attributes:
        own: What each mean has for itself.
        shared: What all means have in common, where repeats are sweeps over all phases.
    """

    own: float
    shared: float = 0.0

    @property
    def total(self) -> float:
        """Squared relative standard error of one mean."""
        return self.own + self.shared

    def of(self, repeats: float) -> MeanNoise:
        """Return the noise of means over so many times as many repeats."""
        return MeanNoise(self.own / repeats, self.shared / repeats)


NO_NOISE: Final = MeanNoise(1e-10)
"""Of infinitely many repeats: invertible even without a discrepancy."""


def single_repeat_noise(noise: NoiseComponents, samples_by_repeat: IntArray) -> MeanNoise:
    """Return the squared relative errors of the mean speed of one repeat, of its usual size.

    s_rep^2 + s_sam^2 / n, averaged over the repeats (P, R) that have accepted samples n, and s_swp^2, which
    the phases of a sweep share.
    """
    samples = samples_by_repeat[samples_by_repeat > 0]
    own = noise.repeat_fraction**2 + noise.sample_fraction**2 * np.mean(1.0 / samples)
    return MeanNoise(float(own), noise.sweep_fraction**2)
