"""Coverage of credible intervals by stratum of a population."""

from __future__ import annotations

import re
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from swesbi.checks.calibration.ranks import NETWORK, WEIGHTED
from swesbi.checks.calibration.table import StrataTable
from swesbi.report.figures.forest import Panel, Series, forest
from swesbi.report.figures.style import SERIES, Drawing
from swesbi.report.numbers import PARAMETERS, as_percent, count, share
from swesbi.verdict.summary import ANSWERS

NAMES: Final = {"all": "all", "sex F": "female", "sex M": "male"}
QUANTITIES: Final = {
    "age_years": ("age", "years"),
    "hr_bpm": ("heart rate", "/min"),
    "lvedv_ml": ("LVEDV", "mL"),
    "ivsd_cm": ("septum", "cm"),
    "relative_se": ("noise of a speed", ""),
}
BANDS: Final = (
    (0.05, "#EFEFEF", "± 5 points: asked of each stratum"),
    (0.02, "#D2D2D2", "± 2 points: asked of all"),
)
LOOK: Final = {
    name: Series(color, symbol) for (name, symbol), color in zip(PARAMETERS.items(), SERIES, strict=False)
}


def stratum_label(name: str) -> str:
    """Return a stratum in words: "age_years 18 to 40" as "age 18 to 40 years"."""
    quantity, _, limits = name.partition(" ")
    if quantity not in QUANTITIES:
        return NAMES.get(name, name)
    word, unit = QUANTITIES[quantity]
    return f"{word} {limits} {unit}" if unit else f"{word} {_as_percent(limits)}"


def _as_percent(limits: str) -> str:
    """Return limits of a fraction in percent, with one sign: "0.01 to 0.0205" as "1 to 2.05 %"."""
    shown = re.sub(r"\d\S*", lambda number: f"{100.0 * float(number[0]):g}", limits)
    return re.sub(r"(\d)(\D*)$", r"\1 %\2", shown)


def draw_strata(strata: StrataTable, *, interval: float, experiment: str) -> Drawing:
    """Draw coverage by stratum, a panel a sampler, with recordings and efficiency of the weights in names."""
    shown = strata[np.isclose(strata["nominal"], interval)]
    if shown.empty:
        raise ValueError(f"no coverage of {as_percent(interval)} intervals is in the table of strata")
    names = {
        str(row["stratum"]): f"{stratum_label(row['stratum'])} ({count(row['n'])}; "
        f"{share(row['median_efficiency'], 0)})"
        for row in shown.drop_duplicates("stratum").to_dict("records")
    }
    panels = {
        sampler: Panel(ANSWERS[sampler], "coverage", "percent", interval) for sampler in (WEIGHTED, NETWORK)
    }
    title = (
        f"Coverage of {as_percent(interval)} intervals by stratum: fresh contexts of the experiment "
        f"'{experiment}'\nin brackets: recordings; median efficiency of the weights"
    )
    rows = shown.assign(panel=shown["sampler"], row=shown["stratum"], series=shown["parameter"])
    low = min(interval - 0.06, shown["ci_low"].min() - 0.01)
    high = max(interval + 0.06, shown["ci_high"].max() + 0.01)

    def asked(axes: Axes, _: str) -> None:
        for reach, color, label in BANDS:
            axes.axvspan(interval - reach, interval + reach, color=color, lw=0, zorder=-1, label=label)
        axes.set_xlim(low, high)

    return forest(
        rows, panels, LOOK, title=title, names=names, of=("ci_low", "coverage", "ci_high"), behind=asked,
        entries_a_row=5,
    )  # fmt: skip
