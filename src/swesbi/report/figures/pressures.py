"""What the pressures of a cuff add: intervals without and with them, by quantity and subject."""

from __future__ import annotations

from typing import Final

import numpy as np
import pandas as pd

from swesbi.artefacts import UnfitError
from swesbi.checks.pressures import RESISTANCE, PressuresTable
from swesbi.heart.physiology import TIME_CONSTANT, VOLUME_FACTOR
from swesbi.heart.simulate import PA_PER_MMHG
from swesbi.parameters import PEAK_ACTIVE, PHI
from swesbi.report.figures.forest import ENDS, MOST_ROWS, Panel, Series, forest
from swesbi.report.figures.style import EXCLUDED_POSTERIOR, POSTERIOR, Drawing, titled

TITLES: Final = {
    **{parameter.name: parameter.label for parameter in PHI},
    PEAK_ACTIVE.name: "peak active stiffness (kPa)",
    RESISTANCE: "resistance $R_d$ (mmHg s/mL)",
    TIME_CONSTANT: "time constant $R_d C_s$ (s)",
    VOLUME_FACTOR: "stressed volume factor $f_V$",
}
"""Quantities with a panel each, row by row; the table has all subjects and quantities."""
SCALE: Final = {RESISTANCE: 1e-6 / PA_PER_MMHG}
"""From the unit of the table to that of the figure: Pa s/m3 to mmHg s/mL."""
LOOK: Final = {
    "without": Series(EXCLUDED_POSTERIOR, "speeds alone"),
    "with": Series(POSTERIOR, "speeds and cuff pressures", marker="s"),
}


def draw_pressures(table: PressuresTable, *, experiment: str, cohort_title: str) -> Drawing:
    """Draw medians and intervals without and with pressures, a panel a quantity and a row a subject."""
    table = table[table["experiment"] == experiment]
    if table.empty:
        raise UnfitError("table", f"holds no {experiment}; delete it and rerun")
    subjects = list(dict.fromkeys(table["subject"]))[:MOST_ROWS]
    shown = table[table["subject"].isin(subjects)]
    factor = shown["quantity"].map(SCALE).fillna(1.0)
    rows = pd.concat(
        shown.assign(
            row=shown["subject"], panel=shown["quantity"], series=which,
            **{end: shown[f"{which}_{end}"] * factor for end in ENDS},
        )
        for which in LOOK
    )  # fmt: skip
    ratios = shown.groupby("quantity")["width_ratio"].median()
    panels = {
        name: Panel(
            title,
            label=f"width {ratios[name]:.2f} of that without" if np.isfinite(ratios[name]) else "",
            mark=1.0 if name == VOLUME_FACTOR else None,
        )
        for name, title in TITLES.items()
    }
    return forest(rows, panels, LOOK, title=titled("Without and with cuff pressures", cohort_title))
