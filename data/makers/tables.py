"""Tables of virtual volunteers that the makers of shipped recordings share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import pandas as pd

from data.makers.clinical import true_measures
from swesbi.base.arrays import FloatArray
from swesbi.parameters import THETA_NAMES
from swesbi.recording.samples import Samples
from swesbi.virtual.volunteers import OWN_PARAMETERS, Truth

OF_THE_BEAT: Final = ("systolic_aortic_pressure_mmhg", "diastolic_aortic_pressure_mmhg", "ejection_ms")
"""What of the true beat ``truth.csv`` has beside the volumes, which lie in ``truth_curves.csv``."""


def phase_medians(samples: Samples) -> tuple[FloatArray, FloatArray]:
    """Return phase and median speed of every phase with successful samples, ascending; shape (p,) each."""
    table = pd.DataFrame(
        {"index": samples.phase_index, "phase": samples.beat_phase, "speed": samples.speed_m_s}
    ).dropna()
    medians = table.groupby("index").median().sort_values("phase")
    return medians["phase"].to_numpy(np.float64), medians["speed"].to_numpy(np.float64)


def truth_table(truths: Sequence[Truth]) -> pd.DataFrame:
    """Return one row a volunteer: theta, passive scale, the richer physiology, what the true beat does."""
    return pd.DataFrame([_truth_row(truth) for truth in truths])


def haemodynamics(truth: Truth) -> dict[str, float]:
    """Return what the true beat does: volumes, ejection fraction, pressures, length of ejection."""
    beats, true = truth.beats, true_measures(truth)
    return {
        "end_diastolic_volume_ml": float(beats.end_diastolic_volume_ml[0]),
        "end_systolic_volume_ml": float(beats.end_systolic_volume_ml[0]),
        "ejection_fraction": float(beats.ejection_fraction[0]),
        "peak_ventricular_pressure_mmhg": float(beats.ventricular_pressure_mmhg[0].max()),
        "systolic_aortic_pressure_mmhg": true.sbp_mmhg,
        "diastolic_aortic_pressure_mmhg": true.dbp_mmhg,
        "ejection_ms": true.lvet_ms,
    }


def _truth_row(truth: Truth) -> dict[str, str | float]:
    volunteer = truth.volunteer
    theta = dict(zip(THETA_NAMES, volunteer.theta, strict=True))
    physiology = {name: getattr(volunteer, name) for name in OWN_PARAMETERS}
    scale = round(truth.passive_scale_kpa, 4)
    beat = {name: round(haemodynamics(truth)[name], 1) for name in OF_THE_BEAT}
    return {"subject": volunteer.context.subject, **theta, "passive_scale_kpa": scale, **physiology, **beat}


def markdown(table: pd.DataFrame) -> str:
    """Return a table of texts as Markdown."""
    head = [" | ".join(map(str, table.columns)), "|".join(["---"] * len(table.columns))]
    rows = [" | ".join(map(str, row)) for row in table.itertuples(index=False)]
    return "\n".join(f"| {line} |" if "---" not in line else f"|{line}|" for line in (*head, *rows))
