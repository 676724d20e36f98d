"""How far acquisition noise of each level takes the observed curve from the true one.

The residuals that the paper prints bound the noise of its curves from above, and so choose the level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from swesbi.base.arrays import FloatArray
from swesbi.base.progress import Progress
from swesbi.recording.acquisition import TruthCurve, acquire
from swesbi.recording.acquisition_settings import ACQUISITION, AcquisitionSettings
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.recording.phases import nominal_phases, sample_cycle, to_grid
from swesbi.recording.settings import RecordingSettings
from swesbi.seeds import generator
from swesbi.virtual.volunteers import Truth

NOISE_LEVELS: Final = "noise_levels.csv"
SAMPLE_FRACTIONS: Final = (0.03, 0.04, 0.05, 0.06, 0.07, 0.08)
SAMPLE_OVER_REPEAT: Final = 2.0
REPEAT_OVER_SWEEP: Final = 2.0
SEEDS: Final = range(1001, 1101)
"""Acquisition seeds of the measurement: neither the shipped one nor those of the other recordings."""
COMPARED: Final = ("A", "B", "C", "D")
"""The volunteers that stand where the paper prints a residual."""
PAPER_RMSE_KPA: Final = {"A": 0.76, "B": 1.40, "C": 0.87, "D": 1.53}
"""RMSE of the posterior predictive median (paper, Tab. 1); the volunteers of these names are other people."""


@dataclass(frozen=True)
class Residual:
    """RMSE of an observed curve on the analysis grid, in kPa.

    Attributes:
        as_recorded: Against the true curve.
        without_scale: Against the true curve times the factor that fits best, as a fit of ``k_0`` and the
            passive scale finds it; errors that all speeds share are no part of it.
    """

    as_recorded: float
    without_scale: float


def at_level(sample_fraction: float, settings: AcquisitionSettings) -> AcquisitionSettings:
    """Return a protocol with noise of this level: samples, repeats and sweeps in fixed proportion."""
    repeat = sample_fraction / SAMPLE_OVER_REPEAT
    noise = {"sample_sd_fraction": sample_fraction, "repeat_sd_fraction": repeat}
    return settings.model_copy(update={**noise, "sweep_fraction": repeat / REPEAT_OVER_SWEEP})


def residual(truth: TruthCurve, observed: Observation) -> Residual:
    """Compare an observed curve with the true one, taken at the same measured phases as a fit would be."""
    true = through_phases(truth, observed.measured_phase, len(observed.grid))
    factor = float(observed.curve_kpa @ true / (true @ true))
    return Residual(_rms(observed.curve_kpa - true), _rms(observed.curve_kpa - factor * true))


def through_phases(truth: TruthCurve, phase: FloatArray, grid_points: int) -> FloatArray:
    """Return the curve through these phases of the true one, on the analysis grid; shape (grid_points,)."""
    return to_grid(phase, sample_cycle(truth.cycle_phase, truth.stiffness_kpa, phase), grid_points)


def interpolation_error_kpa(truth: TruthCurve, grid_points: int = 1001) -> float:
    """Return the RMSE between the true curve and the one through the nominal phases of the protocol."""
    grid = np.arange(grid_points - 1) / (grid_points - 1)
    true = sample_cycle(truth.cycle_phase, truth.stiffness_kpa, grid)
    return _rms(through_phases(truth, nominal_phases(ACQUISITION.phases), grid_points)[:-1] - true)


def measure_level(
    truths: Sequence[Truth],
    sample_fraction: float,
    recording: RecordingSettings,
    grid_points: int,
    seeds: Sequence[int],
) -> dict[str, Residual]:
    """Return the residual of each volunteer, in the mean over recordings with noise of this level.

    Args:
        truths: The volunteers.
        sample_fraction: Error of one spatial sample; that of repeats and sweeps goes with it.
        recording: Quality control.
        grid_points: Size of the analysis grid.
        seeds: Acquisition seeds; streams are those of :func:`swesbi.virtual.volunteers.record`.

    Raises:
        RecordingError: Ingestion refuses a recording.
    """
    found = {}
    for truth in truths:
        context = truth.volunteer.context
        settings = at_level(sample_fraction, truth.volunteer.acquisition)
        streams = (generator(seed, "acquisition", context.subject) for seed in seeds)
        residuals = [
            residual(
                truth.curve,
                ingest(acquire(truth.curve, context, settings, stream), context, recording, grid_points),
            )
            for stream in streams
        ]
        found[context.subject] = Residual(
            float(np.mean([each.as_recorded for each in residuals])),
            float(np.mean([each.without_scale for each in residuals])),
        )
    return found


def noise_levels(truths: Sequence[Truth], recording: RecordingSettings, grid_points: int) -> pd.DataFrame:
    """Measure every level on the volunteers that are compared with the paper.

    Returns:
        One row a level: the errors as fractions of the speed, the residual of each volunteer without scale,
        their mean, and the mean as recorded, in kPa.
    """
    compared = [truth for truth in truths if truth.volunteer.context.subject in COMPARED]
    progress, rows = Progress("noise levels", len(SAMPLE_FRACTIONS), unit="level"), []
    for fraction in SAMPLE_FRACTIONS:
        noise = at_level(fraction, ACQUISITION)
        found = measure_level(compared, fraction, recording, grid_points, SEEDS)
        rows.append(
            {
                "sample_sd_fraction": noise.sample_sd_fraction,
                "repeat_sd_fraction": noise.repeat_sd_fraction,
                "sweep_fraction": noise.sweep_fraction,
                "scale_fraction": noise.scale_fraction,
                **{f"rmse_{name}_kpa": each.without_scale for name, each in found.items()},
                "rmse_kpa": float(np.mean([each.without_scale for each in found.values()])),
                "rmse_as_recorded_kpa": float(np.mean([each.as_recorded for each in found.values()])),
            }
        )
        progress.step()
    return pd.DataFrame(rows)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
