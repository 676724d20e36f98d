"""Names, units and order of the inferred parameters theta = (k_0, k_ATP, k_SR)."""

from __future__ import annotations

from typing import Final

THETA_NAMES: Final = ("k0_kpa", "k_atp_per_s", "k_sr_per_s")
THETA_UNITS: Final = ("kPa", "1/s", "1/s")
THETA_COLUMNS: Final = "kPa, s-1, s-1"
"""Units of the columns of theta, as artefacts say them."""
THETA_LABELS: Final = (
    r"$k_0$ (kPa)",
    r"$k_\mathrm{ATP}$ (s$^{-1}$)",
    r"$k_\mathrm{SR}$ (s$^{-1}$)",
)
