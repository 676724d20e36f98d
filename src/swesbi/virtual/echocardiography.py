"""The end-systolic volume that echocardiography lists for a heart: its own, with an error."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from swesbi.context import Context
from swesbi.population.contexts import is_plausible

MAX_ATTEMPTS: Final = 100


def with_own_lvesv(
    context: Context, volume_ratio: float, lvesv_fraction: float, rng: np.random.Generator
) -> Context:
    """Return the context with the LVESV that is measured of the heart's own beat.

    LVESV = LVEDV ESV / EDV exp(sd z), z standard normal: the listed LVEDV sets the geometry, so the beat's
    volumes are reported on its scale. An error by which ingestion would refuse the context is drawn again.

    Args:
        context: As it is drawn; its LVESV is not used.
        volume_ratio: ESV / EDV of the beat.
        lvesv_fraction: Standard deviation of the logarithm of a measured LVESV.
        rng: Stream of the heart.

    Raises:
        RuntimeError: Ingestion would refuse whatever is measured.
    """
    own_ml = context.lvedv_ml * volume_ratio
    for _ in range(MAX_ATTEMPTS):
        error = float(np.exp(lvesv_fraction * rng.standard_normal()))
        measured = replace(context, lvesv_ml=own_ml * error)
        if is_plausible(measured):
            return measured
    raise RuntimeError(
        f"{context.subject}: no LVESV that ingestion admits in {MAX_ATTEMPTS} measurements of a heart that "
        f"ejects {1.0 - volume_ratio:.3f} of its blood"
    )
