"""The tables of the virtual cohort: contexts, truth, and the recorded speeds beside published ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Final

import numpy as np
import pandas as pd

from swesbi.arrays import FloatArray
from swesbi.parameters import PASSIVE_SCALE, THETA_NAMES
from swesbi.recording.phases import to_grid
from swesbi.recording.samples import Samples
from swesbi.virtual_cohort.volunteers import LATE_DIASTOLE, OWN_PARAMETERS, Truth

FINE_GRID: Final = 2001
LATE_DIASTOLIC_SPEED_M_S: Final = (0.87, 1.51)
PEAK_SPEED_M_S: Final = (2.1, 5.5)
CLOSURE_SPEED_M_S: Final = (2.5, 4.5)
STIFFNESS_RATIO: Final = (5.0, 25.0)
EJECTION_MS: Final = (292.0, 23.0)


@dataclass(frozen=True)
class SpeedSummary:
    """What a recording says at a glance, from the medians of its successful samples.

    ``closure_m_s`` is the speed when forward flow through the aortic valve ends in the true beat.
    """

    late_diastolic_m_s: float
    peak_m_s: float
    closure_m_s: float
    stiffness_ratio: float


def phase_medians(samples: Samples) -> tuple[FloatArray, FloatArray]:
    """Return phase and median speed of every phase with successful samples, ascending; shape (p,) each."""
    table = pd.DataFrame(
        {"index": samples.phase_index, "phase": samples.beat_phase, "speed": samples.speed_m_s}
    ).dropna()
    medians = table.groupby("index").median().sort_values("phase")
    return medians["phase"].to_numpy(np.float64), medians["speed"].to_numpy(np.float64)


def summarise_speeds(samples: Samples, truth: Truth) -> SpeedSummary:
    """Summarise a recording by late-diastolic, peak and valve-closure speed, and the stiffness ratio."""
    phase, speed = phase_medians(samples)
    late = float(speed[(phase >= LATE_DIASTOLE[0]) & (phase <= LATE_DIASTOLE[1])].mean())
    curve = to_grid(phase, speed, FINE_GRID)
    closure = float(np.interp(valve_closure_phase(truth), np.linspace(0.0, 1.0, FINE_GRID), curve))
    peak = float(speed.max())
    return SpeedSummary(late, peak, closure, (peak / late) ** 2)


def valve_closure_phase(truth: Truth) -> float:
    """Return the phase at which forward flow through the aortic valve ends."""
    return float(truth.beats.cycle_phase[np.flatnonzero(truth.beats.aortic_flow_ml_s[0] > 0.0)[-1]])


def context_table(truths: Sequence[Truth]) -> pd.DataFrame:
    """Return the rows of ``subjects.csv``."""
    return pd.DataFrame([asdict(truth.volunteer.context) for truth in truths])


def truth_table(truths: Sequence[Truth]) -> pd.DataFrame:
    """Return one row a volunteer: true theta, passive scale, and the parameters of the richer physiology."""
    return pd.DataFrame([_truth_row(truth) for truth in truths])


def curve_table(truths: Sequence[Truth]) -> pd.DataFrame:
    """Return the noiseless curves: one row per volunteer and cycle point."""
    return pd.concat([_curve_rows(truth) for truth in truths], ignore_index=True)


def haemodynamics(truth: Truth) -> dict[str, float]:
    """Return what the true beat does: volumes, ejection fraction, pressures, length of ejection."""
    beats, context = truth.beats, truth.volunteer.context
    ejecting = np.mean(beats.aortic_flow_ml_s[0] > 0.0)
    return {
        "end_diastolic_volume_ml": float(beats.end_diastolic_volume_ml[0]),
        "end_systolic_volume_ml": float(beats.end_systolic_volume_ml[0]),
        "ejection_fraction": float(beats.ejection_fraction[0]),
        "peak_ventricular_pressure_mmhg": float(beats.ventricular_pressure_mmhg[0].max()),
        "systolic_arterial_pressure_mmhg": float(beats.arterial_pressure_mmhg[0].max()),
        "diastolic_arterial_pressure_mmhg": float(beats.arterial_pressure_mmhg[0].min()),
        "ejection_ms": float(1e3 * ejecting * context.period_s),
    }


def _truth_row(truth: Truth) -> dict[str, str | float]:
    volunteer = truth.volunteer
    theta = dict(zip(THETA_NAMES, volunteer.theta, strict=True))
    physiology = {name: getattr(volunteer, name) for name in OWN_PARAMETERS}
    scale = round(truth.passive_scale_kpa, 4)
    return {"subject": volunteer.context.subject, **theta, PASSIVE_SCALE.name: scale, **physiology}


def _curve_rows(truth: Truth) -> pd.DataFrame:
    columns = {
        "cycle_phase": truth.curve.cycle_phase,
        "passive_kpa": truth.passive_kpa,
        "active_kpa": truth.active_kpa,
        "stiffness_kpa": truth.curve.stiffness_kpa,
        "stretch": truth.beats.stretch[0],
        "volume_ml": truth.beats.volume_ml[0],
    }
    return pd.DataFrame({"subject": truth.volunteer.context.subject, **columns})
