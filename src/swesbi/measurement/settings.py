"""Settings of the measurement: operator, passive baseline, summary S(.), speeds, clinical measures."""

from __future__ import annotations

from typing import Final, Literal

from pydantic import Field

from swesbi.base.settings import CycleWindow, Settings
from swesbi.prior import ParameterPrior
from swesbi.recording.clinical import ClinicalErrors

SCALARS: Final = (
    ("baseline_kpa", "kPa"),
    ("minimum_kpa", "kPa"),
    ("maximum_kpa", "kPa"),
    ("amplitude_kpa", "kPa"),
    ("auc_kpa", "kPa"),
    ("post_peak_auc_kpa", "kPa"),
    ("max_up_slope_kpa_per_cycle", "kPa"),
    ("mean_up_slope_kpa_per_cycle", "kPa"),
    ("time_to_peak_cycle", "1"),
    ("rise_time_10_90_cycle", "1"),
    ("time_to_half_rise_cycle", "1"),
    ("max_down_slope_kpa_per_cycle", "kPa"),
    ("decay_slope_kpa_per_cycle", "kPa"),
    ("half_relaxation_time_cycle", "1"),
    ("relaxation_time_to_10_cycle", "1"),
    ("full_width_half_maximum_cycle", "1"),
)
SCALAR_NAMES: Final = tuple(name for name, _ in SCALARS)
SCALAR_UNITS: Final = tuple(unit for _, unit in SCALARS)
SUMMARY_NAMES: Final = SCALAR_NAMES + tuple(f"trajectory_{index:02d}_kpa" for index in range(30))
SUMMARY_UNITS: Final = SCALAR_UNITS + ("kPa",) * 30


PassiveBeat = Literal["own", "reference"]
"""Along whose stretch the passive stiffness runs: each simulation's own, or one at the prior's centre."""


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


Landmarks = Literal["paper", "robust"]
"""How S(.) finds peak and crossings: from single values, or so that one noisy phase cannot move them far."""


class SummarySettings(Settings):
    """The summary S(.) of a curve: scalar descriptors and, if wanted, the resampled trajectory."""

    baseline_window: CycleWindow
    landmarks: Landmarks = Field(
        default="paper",
        description="paper: largest value, crossings next to it; robust: parabola through the largest "
        "values, outermost crossings",
    )
    trajectory_points: int = Field(ge=2, le=500, description="Uniformly resampled values of the curve.")
    use_trajectory: bool = Field(description="Whether S(.) holds the trajectory beside the scalars.")


def summary_names(settings: SummarySettings) -> tuple[str, ...]:
    """Return the names of the features under these settings, units included."""
    return SCALAR_NAMES + _trajectory_names(settings)


def summary_units(settings: SummarySettings) -> tuple[str, ...]:
    """Return the units of the features under these settings; slopes are kPa per (unitless) cycle."""
    return SCALAR_UNITS + ("kPa",) * len(_trajectory_names(settings))


def _trajectory_names(settings: SummarySettings) -> tuple[str, ...]:
    points = settings.trajectory_points if settings.use_trajectory else 0
    return tuple(f"trajectory_{index:02d}_kpa" for index in range(points))


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


class ClinicalSettings(ClinicalErrors):
    """Errors of the measures, and the prior of what becomes free with them."""

    stressed_volume_factor: ParameterPrior = Field(
        description="prior of the factor of the stressed volume, free where there are pressures"
    )

    @property
    def errors(self) -> ClinicalErrors:
        """The errors alone."""
        return ClinicalErrors(**{name: getattr(self, name) for name in ClinicalErrors.model_fields})
