"""Settings of the measurement operator, the passive baseline and the summary S(.)."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from swesbi.settings import Settings
from swesbi.settings_types import CycleWindow


class MeasurementSettings(Settings):
    """How a simulated cycle becomes the curve that elastography would show."""

    grid_points: int = Field(ge=20, le=2000, description="Points of the uniform analysis grid on [0, 1].")
    active_stiffness_map: Literal["identity", "series_spring"] = Field(
        description="Name of the map from the simulated active stiffness k_c to the measured E_act."
    )


class PassiveSettings(Settings):
    """The passive baseline E_pass = a exp(b (lambda^2 - 1)) and how its scale a is calibrated."""

    exponent_b: float = Field(ge=0, le=20, description="Exponent b; 0 makes the baseline constant.")
    late_diastolic_window: CycleWindow


class SummarySettings(Settings):
    """The summary S(.) of a curve: scalar descriptors and, if wanted, the resampled trajectory."""

    baseline_window: CycleWindow
    trajectory_points: int = Field(ge=2, le=500, description="Uniformly resampled values of the curve.")
    use_trajectory: bool = Field(description="Whether S(.) holds the trajectory beside the scalars.")
