"""Columns of the file of a recording, gated or free-running, and the words of its status."""

from __future__ import annotations

from typing import Final

STATUS_OK: Final = "ok"
FAILED_STATUSES: Final = ("no_wave", "motion", "low_r2", "bound_hit")
SPEED: Final = "shear_wave_speed_m_s"
MODULUS: Final = "youngs_modulus_kpa"
SHEAR_MODULUS: Final = "shear_modulus_kpa"
MEASURED: Final = (SPEED, MODULUS, SHEAR_MODULUS)
"""What a recording measures, one of these."""
COLUMNS: Final = (
    "phase_index",
    "trigger_delay_ms",
    "rr_ms",
    "repeat",
    "sample",
    SPEED,
    "fit_r2",
    "status",
)
TIME: Final = "time_ms"
STANDARD_ERROR: Final = "se_m_s"
EVENT: Final = "event"
"""What set off a wave, in tables of natural waves; such a table is refused."""
FREE_REQUIRED: Final = (TIME, "rr_ms")
FREE_OPTIONAL: Final = ("beat", "repeat", STANDARD_ERROR, "fit_r2", "status")
FREE_COLUMNS: Final = (*FREE_REQUIRED, SPEED, *FREE_OPTIONAL)
"""Of a free-running recording: it has instants in place of phases."""
