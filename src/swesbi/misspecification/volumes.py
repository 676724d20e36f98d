"""The physics that nobody fitted: predicted end-systolic volume and ejection fraction beside the measured.

The prior says nothing of how far model and echocardiography may differ, so there is no null distribution:
the distance is told in units of a stated tolerance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swesbi.context import Context
from swesbi.forward_model.beats import Beats
from swesbi.forward_model.periodic import Status
from swesbi.inference.support import SupportTest
from swesbi.misspecification.settings import VolumeSettings

FloatArray = NDArray[np.float64]


def volume_tests(beats: Beats, context: Context, settings: VolumeSettings) -> tuple[SupportTest, ...]:
    """Compare predicted LVESV and EF, one of each posterior draw, with the measured ones."""
    works = beats.status == Status.PERIODIC
    fraction = (context.lvedv_ml - context.lvesv_ml) / context.lvedv_ml
    return (
        _volume_test(
            "end_systolic_volume",
            beats.end_systolic_volume_ml[works],
            context.lvesv_ml,
            settings.lvesv_tolerance_fraction * context.lvesv_ml,
            settings.strained_abs_z,
            "LVESV {0:.0f} mL predicted [{1:.0f}, {2:.0f}], {3:.0f} mL measured",
        ),
        _volume_test(
            "ejection_fraction",
            beats.ejection_fraction[works],
            fraction,
            settings.ejection_fraction_tolerance,
            settings.strained_abs_z,
            "EF {0:.2f} predicted [{1:.2f}, {2:.2f}], {3:.2f} measured",
        ),
    )


def volume_z(predicted: FloatArray, measured: float, tolerance: float) -> float:
    """Return (median - measured) / sqrt(posterior variance + tolerance^2)."""
    return float((np.median(predicted) - measured) / np.hypot(predicted.std(), tolerance))


def _volume_test(
    name: str, predicted: FloatArray, measured: float, tolerance: float, limit: float, words: str
) -> SupportTest:
    z = volume_z(predicted, measured, tolerance)
    low, middle, high = np.quantile(predicted, (0.05, 0.5, 0.95))
    detail = f"{words.format(middle, low, high, measured)} (z = {z:.2f})"
    return SupportTest(
        name=name, statistic=z, p_value=None, threshold=limit, flagged=abs(z) > limit, detail=detail
    )
