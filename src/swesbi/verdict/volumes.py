"""Predicted volumes of the cavity beside the measured ones, which nobody fitted.

The model lets one septal thickness stand for the whole sphere: how far it may be wrong in a volume is how far
a wall of another thickness moves it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.context import Context
from swesbi.heart.periodic import Status
from swesbi.heart.simulate import Beats
from swesbi.measurement.likelihood import SpeedModel
from swesbi.verdict.beat import Predicted
from swesbi.verdict.settings import VolumeSettings
from swesbi.verdict.verdict import VerdictTest

FloatArray = NDArray[np.float64]
WALL_DRAWS: Final = 200
"""Of the posterior, simulated with another wall: its median moves by less than a tenth of its distance."""
THICK_CM: Final = 1.0
"""Thicker walls are tried thinner, others thicker: neither leaves what the forward model is declared for."""


def volume_tests(
    model: SpeedModel, phi: FloatArray, beats: Beats, settings: VolumeSettings
) -> tuple[VerdictTest, ...]:
    """Compare the end-diastolic and end-systolic volumes that the posterior predicts with LVEDV and LVESV.

    Args:
        model: The recording and its model.
        phi: Equally weighted posterior draws (n, d).
        beats: Their beats.
        settings: Tolerances and limits.

    Raises:
        ValueError: No beat becomes periodic with a wall of another thickness.
    """
    context, works = model.recording.context, beats.status == Status.PERIODIC
    moved = _moved_by_wall(model, phi, beats, settings.wall_fraction)
    diastolic = Predicted(
        beats.end_diastolic_volume_ml[works],
        moved[0],
        context.lvedv_ml,
        settings.lvedv_tolerance_fraction * context.lvedv_ml,
    )
    systolic = Predicted(
        beats.end_systolic_volume_ml[works],
        moved[1],
        context.lvesv_ml,
        settings.lvesv_tolerance_fraction * context.lvesv_ml,
    )
    limit = settings.strained_abs_z
    return (
        diastolic.test("end_diastolic_volume", "LVEDV", "mL", limit),
        systolic.test("end_systolic_volume", "LVESV", "mL", limit),
    )


def _moved_by_wall(model: SpeedModel, phi: FloatArray, beats: Beats, fraction: float) -> tuple[float, float]:
    """Return how far (mL) a wall thicker or thinner by this fraction moves both volumes, in the median."""
    rows = np.unique(np.linspace(0, len(phi) - 1, WALL_DRAWS).astype(int))
    recording = replace(model.recording, context=_with_other_wall(model.recording.context, fraction))
    other = replace(model, recording=recording).simulate(phi[rows])
    both = (beats.status[rows] == Status.PERIODIC) & (other.status == Status.PERIODIC)
    if not both.any():
        raise ValueError(
            f"subject {recording.context.subject}: no beat becomes periodic with ivsd_cm = "
            f"{recording.context.ivsd_cm:g}; check the context"
        )
    diastolic = other.end_diastolic_volume_ml - beats.end_diastolic_volume_ml[rows]
    systolic = other.end_systolic_volume_ml - beats.end_systolic_volume_ml[rows]
    return float(np.median(np.abs(diastolic[both]))), float(np.median(np.abs(systolic[both])))


def _with_other_wall(context: Context, fraction: float) -> Context:
    sign = -1.0 if context.ivsd_cm > THICK_CM else 1.0
    return replace(context, ivsd_cm=context.ivsd_cm * (1.0 + sign * fraction))
