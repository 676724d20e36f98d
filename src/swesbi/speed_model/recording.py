"""What the observation model knows of one recording: its phases, speeds and standard errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.context import Context
from swesbi.recording import Observation

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


def measured_speeds(observation: Observation) -> SpeedRecording:
    """Return the measured phases of an observed curve with their speeds and standard errors."""
    measured = observation.measured
    speed = observation.speed_m_s[measured]
    return SpeedRecording(
        context=observation.context,
        phase=observation.phase[measured],
        speed_m_s=speed,
        relative_se=observation.speed_se_m_s[measured] / speed,
    )
