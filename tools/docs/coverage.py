"""How often 90 % intervals contain the truth, in one table of hearts of the model and of other generators.

It is made of stored tables alone: those of `make full` in ``docs/tables``, and those of the validation.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import pandas as pd

NOMINAL: Final = 0.9
ONE_LAW: Final = ("k0_kpa", "k_atp_per_s", "k_sr_per_s")
QUANTITIES: Final = ("peak_active_kpa", *ONE_LAW)
OWN: Final = {
    "amortised_recovery": ("the model's own", "model's own noise"),
    "amortised_recovery_acquisition": ("the model's own", "sample by sample"),
    "calibrated_recovery": ("the model's own, shaped like the volunteers", "model's own noise"),
    "calibrated_recovery_acquisition": ("the model's own, shaped like the volunteers", "sample by sample"),
    "amortised_pushes": ("the model's own", "free-running pushes"),
}
"""Stored tables of recordings that the model made: whose hearts, and how they were recorded."""
TOGETHER: Final = "pooled: c, d, h"


def coverage_table(root: Path) -> pd.DataFrame:
    """Return a row per kind of heart: hearts, share not contradicted, coverage of 90 % intervals.

    Coverage of the model's own hearts is of all, that of other generators of hearts not contradicted. Columns
    ``all_<quantity>`` have it of all answered hearts, whatever the verdict.
    """
    own = [_own_row(root, name) for name in OWN]
    validation = pd.read_csv(root / "studies" / "validation" / "tables" / "rounds.csv")
    last = validation[validation["round"] == validation["round"].max()]
    generators = [name for name in last["generator"].unique() if not name.startswith("pooled")]
    others = [_generator_row(last[last["generator"] == name]) for name in (*generators, TOGETHER)]
    return pd.DataFrame([*own, *others])


def _own_row(root: Path, name: str) -> dict[str, object]:
    table = pd.read_csv(root / "docs" / "tables" / f"{name}.csv")
    table = table[table["nominal"] == NOMINAL]
    if "pushes" in table:
        table = table[table["pushes"].astype(str) == "all"]
    rows = table.set_index("parameter")
    hearts, recordings = OWN[name]
    row: dict[str, object] = {"hearts": hearts, "recordings": recordings, "n": int(rows["n"].iloc[0])}
    for quantity in ONE_LAW:
        row[quantity] = row[f"all_{quantity}"] = rows.loc[quantity, "coverage"]
        row[f"{quantity}_low"] = rows.loc[quantity, "ci_low"]
        row[f"{quantity}_high"] = rows.loc[quantity, "ci_high"]
    return row


def _generator_row(rows: pd.DataFrame) -> dict[str, object]:
    first = rows.iloc[0]
    name = str(first["generator"])
    letter, _, title = name.partition(": ")
    row: dict[str, object] = {
        "hearts": "(c), (d), (h) together" if name == TOGETHER else f"({letter}) {title}",
        "recordings": "sample by sample",
        "n": int(first["n"]),
        "not_contradicted": first["not_contradicted"],
        "n_not_contradicted": int(first["n_not_contradicted"]),
    }
    by_quantity = rows.set_index("quantity")
    for quantity in (name for name in QUANTITIES if name in by_quantity.index):
        found = by_quantity.loc[quantity]
        row[quantity] = found["coverage_not_contradicted"]
        row[f"{quantity}_low"] = found["coverage_not_contradicted_low"]
        row[f"{quantity}_high"] = found["coverage_not_contradicted_high"]
        row[f"all_{quantity}"] = found["coverage"]
    return row
