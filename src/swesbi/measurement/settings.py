"""Settings of the measurement: operator, passive baseline, summary S(.), speeds, clinical measures."""

from __future__ import annotations

from typing import Final, Literal

from pydantic import Field

from swesbi.base.settings import CycleWindow, Settings

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


class MeasurementSettings(Settings):
    """How a simulated cycle becomes the curve that elastography would show."""

    grid_points: int = Field(
        ge=20,
        le=2000,
        description="Points of the uniform analysis grid on [0, 1]. The paper's coverages are counted on "
        "100 points. Chosen.",
    )
    active_stiffness_map: Literal["identity", "series_spring"] = Field(
        description="Name of the map from the simulated active stiffness k_c to the measured E_act. "
        "identity: E_act = k_c, the stiffness of bonds frozen for the wave's passage (Chapelle et al. "
        "2012)."
    )


class PassiveSettings(Settings):
    """The paper's passive baseline E_pass = a exp(b (lambda^2 - 1)), and how its scale a is calibrated."""

    exponent_b: float = Field(
        ge=0,
        le=20,
        description="Exponent b; 0 makes the baseline constant. Chosen: g(lambda) = exp(b (lambda^2 - 1)) "
        "is small in systole. The paper's own formula is unpublished.",
    )
    late_diastolic_window: CycleWindow = Field(
        description="Part of the cycle in which the scale is calibrated; equals "
        "recording.late_diastolic_window."
    )


Landmarks = Literal["paper", "robust"]
"""How S(.) finds peak and crossings: from single values, or so that one noisy phase cannot move them far."""


DecaySlope = Literal["90_to_10", "peak_to_end"]
"""Between which points of the fall S(.) takes the post-peak decay slope."""


class SummarySettings(Settings):
    """The summary S(.) of a curve: scalar descriptors and, if wanted, the resampled trajectory."""

    baseline_window: CycleWindow = Field(
        description="Part of the cycle whose values are the baseline of the curve."
    )
    landmarks: Landmarks = Field(
        default="paper",
        description="How peak and crossings are found. paper: largest value, crossings next to it. "
        "robust: a parabola through the largest values, outermost crossings. Chosen.",
    )
    decay_slope: DecaySlope = Field(
        default="90_to_10",
        description="Where the decay slope runs. 90_to_10: between 90 and 10 % of the amplitude. "
        "peak_to_end: from the peak to the end of the cycle. Chosen.",
    )
    trajectory_points: int = Field(
        ge=2, le=500, description="Uniformly resampled values of the curve (paper, Sec. 2.3)."
    )
    use_trajectory: bool = Field(
        description="Whether S(.) holds the trajectory beside the scalars. The paper (Sec. 2.3) has 16 "
        "scalars and 30 trajectory values."
    )


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

    Where physiology is free, log evidence asks for no timing error, and for none or 1 % of speed. Both
    cover as well there. More of speed is kept for hearts of another structure. Its price are intervals
    on these that contain the truth a little too often.
    """

    speed_fraction: float = Field(
        ge=0,
        le=0.5,
        description="Standard deviation of the relative error of the speed. Chosen: kept for hearts of "
        "another structure.",
    )
    timing_cycle: float = Field(
        ge=0,
        le=0.1,
        description="Standard deviation of the error in phase, a fraction of the cycle. Chosen: log "
        "evidence asks for none.",
    )


class SpeedObservationSettings(Settings):
    """Noise on the measured speeds, estimated from the cohort's repeats, and what the model may miss."""

    discrepancy: DiscrepancySettings = Field(
        description="What the model may miss. It was chosen on 50 generated subjects with known model "
        "error, none of them in the cohort (studies/discrepancy)."
    )
