"""What the observation model knows of one recording: its phases, speeds and standard errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.context import Context
from swesbi.noise.error import relative_se
from swesbi.recording.observation import Observation
from swesbi.recording.speed import NoiseComponents

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class SpeedRecording:
    """One recording's measured phases, p of them; missing ones are left out.

    Attributes:
        context: The subject's context.
        phase: Measured phases in [0, 1), ascending; shape (p,).
        speed_m_s: Mean shear-wave speed there; shape (p,).
        relative_se: Standard error of each mean as a fraction of it; shape (p,).
    """

    context: Context
    phase: FloatArray
    speed_m_s: FloatArray
    relative_se: FloatArray

    @property
    def subject(self) -> str:
        """The subject's name."""
        return self.context.subject


def measured_speeds(observation: Observation, noise: NoiseComponents | None = None) -> SpeedRecording:
    """Return the measured phases of an observed curve with their speeds and standard errors.

    Args:
        observation: The observed curve.
        noise: Components of the cohort, from which the standard errors follow by the recording's own
            numbers of repeats and samples; without them, those of the recording itself.
    """
    measured = observation.measured
    components = observation.noise if noise is None else noise
    return SpeedRecording(
        context=observation.context,
        phase=observation.phase[measured],
        speed_m_s=observation.speed_m_s[measured],
        relative_se=relative_se(observation.samples_by_repeat[measured], components),
    )
