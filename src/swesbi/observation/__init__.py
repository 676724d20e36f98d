"""Measurement operator, passive baseline and summary: from simulated beats to what inference compares."""

from swesbi.observation.interpolation import analysis_grid, sample_cycle, slope_cycle, to_grid
from swesbi.observation.operator import total_at_phases, total_curves, total_cycle
from swesbi.observation.passive import (
    PassiveBaseline,
    PassiveCalibrationError,
    calibrate_passive,
    late_diastolic,
    passive_scale,
    passive_shape,
)
from swesbi.observation.settings import MeasurementSettings, PassiveSettings, SummarySettings
from swesbi.observation.stiffness_map import active_stiffness_map
from swesbi.observation.summary import (
    SCALAR_NAMES,
    SCALAR_UNITS,
    SUMMARY_NAMES,
    SUMMARY_UNITS,
    summarise,
    summary_names,
    summary_units,
)

__all__ = [
    "SCALAR_NAMES",
    "SCALAR_UNITS",
    "SUMMARY_NAMES",
    "SUMMARY_UNITS",
    "MeasurementSettings",
    "PassiveBaseline",
    "PassiveCalibrationError",
    "PassiveSettings",
    "SummarySettings",
    "active_stiffness_map",
    "analysis_grid",
    "calibrate_passive",
    "late_diastolic",
    "passive_scale",
    "passive_shape",
    "sample_cycle",
    "slope_cycle",
    "summarise",
    "summary_names",
    "summary_units",
    "to_grid",
    "total_at_phases",
    "total_curves",
    "total_cycle",
]
