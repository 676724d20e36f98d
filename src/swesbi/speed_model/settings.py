"""Settings of the observation model on measured speeds."""

from __future__ import annotations

from pydantic import Field

from swesbi.settings import Settings


class DiscrepancySettings(Settings):
    """By how much the model may miss the truth at a phase, beside the noise of the recording.

    Both terms are independent from phase to phase. The second grows with the slope of the curve: an
    activation that comes or ends at another time than the model's moves rise and relaxation alone.
    """

    speed_fraction: float = Field(ge=0, le=0.5, description="sd of the relative error of the speed")
    timing_cycle: float = Field(ge=0, le=0.1, description="sd of the error in phase, fraction of the cycle")


class SpeedObservationSettings(Settings):
    """Noise on the measured speeds, estimated from the cohort's repeats, and what the model may miss."""

    discrepancy: DiscrepancySettings
