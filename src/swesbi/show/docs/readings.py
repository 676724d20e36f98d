"""The generated parts of the page on readings of the paper's text, from its committed tables."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Self

import pandas as pd

from swesbi.checks.readings.settings import CASES
from swesbi.parameters import THETA_NAMES
from swesbi.show.docs.results import read_table
from swesbi.show.numbers import fixed
from swesbi.show.paper.readings import INTERVALS, PAPER, TOGETHER, closest
from swesbi.show.results import records
from swesbi.show.table import markdown, of_records

NOT_RUN: Final = "Not run yet: `make readings` on a finished study."
TABLES: Final = (
    "readings",
    "readings_given",
    "readings_recovery",
    "readings_verdicts",
    "readings_weights",
)
PAPER_CMAES: Final = "1.36, 2.15, 2.06, 2.02"
PAPER_SBI: Final = "0.76, 1.40, 0.87, 1.53"


@dataclass(frozen=True)
class ReadingsResults:
    """The tables of ``make readings``: by reading, printed number, checkpoint, subject, and weights."""

    table: pd.DataFrame
    given: pd.DataFrame
    recovery: pd.DataFrame
    verdicts: pd.DataFrame
    weights: pd.DataFrame

    @classmethod
    def read(cls, folder: Path) -> Self | None:
        """Read the tables of a folder; None before ``make readings``."""
        paths = [folder / f"{name}.csv" for name in TABLES]
        return cls(*map(read_table, paths)) if all(path.is_file() for path in paths) else None


def tried_part(results: ReadingsResults | None) -> str:
    """Show every reading beside the paper, the paper's row on top, and name the closest to all."""
    if results is None:
        return NOT_RUN
    lines = [_line(row) for row in records(results.table)]
    best, interval = closest(results.table)
    number = int(results.table["tried"].iloc[0])
    said = (
        f"{number} readings were tried. The closest to all is **{best['label']}**, with the "
        f"{INTERVALS[interval]}: distance {fixed(float(best[f'distance_{interval}']), 1)} spreads, "
        f"{int(best[f'given_{interval}'])} of {int(best['of'])} numbers given."
    )
    parts = [said, markdown(of_records(lines)), "![Readings](figures/readings.png)"]
    return "\n\n".join([*parts, _unexplained(results, interval)])


def _line(row: Mapping[Hashable, Any]) -> dict[str, str]:
    paper = row["reading"] == PAPER
    return {
        "reading": str(row["label"]),
        "supported": fixed(float(row["supported"]), 0),
        "RMSE, prior (kPa)": fixed(float(row["rmse_prior_kpa"]), 2),
        "RMSE (kPa)": fixed(float(row["rmse_kpa"]), 2),
        "reduction (%)": fixed(float(row["rmse_reduction_percent"]), 1),
        "R²": fixed(float(row["r2"]), 3),
        "coverage A to D, band of curves": _coverages(row, "curve"),
        "coverage A to D, new observation": _coverages(row, "observed"),
        "cases with all features inside": fixed(float(row["features_inside"]), 0),
        "r(k_0, k_ATP)": fixed(float(row["r_k0_k_atp"]), 2),
        "r(k_0, k_SR)": fixed(float(row["r_k0_k_sr"]), 2),
        "r(k_ATP, k_SR)": fixed(float(row["r_k_atp_k_sr"]), 2),
        "recovery k_0, k_ATP, k_SR (%)": ", ".join(
            fixed(float(row[f"recovery_{name}_percent"]), 1) for name in ("k0", "k_atp", "k_sr")
        ),
        "given, of 16": "" if paper else _both(row, "given", 0),
        "distance": "" if paper else _both(row, "distance", 1),
    }


def _both(row: Mapping[Hashable, Any], name: str, decimals: int) -> str:
    """Return a number by either interval: band of curves, new observation."""
    return ", ".join(fixed(float(row[f"{name}_{interval}"]), decimals) for interval in INTERVALS)


def _coverages(row: Mapping[Hashable, Any], interval: str) -> str:
    return ", ".join(fixed(float(row[f"coverage_{interval}_{case}"]), 2) for case in CASES)


def _unexplained(results: ReadingsResults, interval: str) -> str:
    """Say which numbers the closest reading does not give, and which no reading gives."""
    best, _ = closest(results.table)
    applicable = results.given["interval"].isin(["", interval]) | results.given["interval"].isna()
    of_best = results.given[applicable]
    missed = [
        str(row["number"])
        for row in records(of_best)
        if str(best["label"]) not in str(row["readings"]).split("; ")
    ]
    never = [
        f"{row['number']}{_by(row)} (printed {_short(row['printed'])}, "
        f"nearest {_short(row['nearest_value'])}: {row['nearest']})"
        for row in records(results.given)
        if int(row["given_by"]) == 0
    ]
    return (
        f"What the closest cannot explain: {'; '.join(missed) or 'nothing'}.\n\n"
        f"What no reading gives: {'; '.join(never) or 'nothing'}."
    )


def _by(row: Mapping[Hashable, Any]) -> str:
    interval = row["interval"]
    return f", by the {INTERVALS[str(interval)]}" if interval in INTERVALS else ""


def _short(value: object) -> str:
    return f"{float(str(value)):.3g}".replace("-", "−")


def given_part(results: ReadingsResults | None) -> str:
    """Show for each printed number the readings that give it, and the ranges of their settings."""
    if results is None:
        return NOT_RUN
    rows = [
        {
            "number": f"{row['number']}{_by(row)}",
            "printed": _short(row["printed"]),
            "margin": _short(row["margin"]),
            "readings": _readings_of(row),
            "ranges of settings": _text(row["settings"]) or "–",
        }
        for row in records(results.given)
    ]
    return markdown(of_records(rows))


def _readings_of(row: Mapping[Hashable, Any]) -> str:
    if int(row["given_by"]) == 0:
        return f"none; nearest {_short(row['nearest_value'])}: {row['nearest']}"
    return f"{int(row['given_by'])}: {row['readings']}"


def _text(value: object) -> str:
    return "" if pd.isna(value) else str(value)  # type: ignore[call-overload]


def recovery_part(results: ReadingsResults | None) -> str:
    """Show recovery at every checkpoint of training, where it was asked for."""
    if results is None:
        return NOT_RUN
    several = results.recovery.groupby("reading")["epoch"].transform("size") > 1
    shown = results.recovery[several]
    labels = list(dict.fromkeys(shown["label"]))
    rows = []
    for epoch, part in shown.groupby("epoch", sort=True):
        by_label = part.set_index("label")
        row = {"epoch": f"{int(str(epoch))}"}
        for label in labels:
            known = label in by_label.index
            row[label] = (
                ", ".join(fixed(float(by_label.loc[label, name]), 1) for name in THETA_NAMES)
                if known
                else "–"
            )
        rows.append(row)
    return f"Share of 90 % intervals that hold k_0, k_ATP, k_SR (%).\n\n{markdown(of_records(rows))}"


def verdicts_part(results: ReadingsResults | None) -> str:
    """Show how many recordings of each subject are supported under each reading."""
    if results is None:
        return NOT_RUN
    rows = []
    for subject, part in results.verdicts.groupby("subject", sort=False):
        row = {"subject": str(subject), "recordings": str(int(part["recordings"].iloc[0]))}
        for each in records(part):
            row[f"supported, {each['label']}"] = str(int(each["supported"]))
            row[f"median of the largest z, {each['label']}"] = fixed(float(each["median_max_abs_z"]), 2)
            row[f"most often outside, {each['label']}"] = _text(each["most_often_outside"]) or "–"
        rows.append(row)
    alone = results.verdicts[results.verdicts["subject"] != TOGETHER]
    totals = alone.groupby("label", sort=False)[["supported", "recordings"]].sum()
    said = "; ".join(
        f"{label}: {int(row['supported'])} of {int(row['recordings'])} recordings supported"
        for label, row in totals.iterrows()
    )
    return f"{markdown(of_records(rows))}\n\n{said}."


def weights_part(results: ReadingsResults | None) -> str:
    """Show errors of CMA-ES by weights beside the posterior's, and say when the paper's order comes out."""
    if results is None:
        return NOT_RUN
    rows = [
        {
            "recordings": str(row["label"]),
            "weights of MAE, correlation, peak": _weights_of(row),
            "CMA-ES, A to D (kPa)": ", ".join(fixed(float(row[f"cmaes_{case}_kpa"]), 2) for case in CASES),
            "SBI, A to D (kPa)": ", ".join(fixed(float(row[f"sbi_{case}_kpa"]), 2) for case in CASES),
            "SBI below": f"{int(row['below'])} of {int(row['supported'])}",
        }
        for row in records(results.weights)
    ]
    return f"{_order(results.weights)}\n\n{markdown(of_records(rows))}"


def _order(weights: pd.DataFrame) -> str:
    printed = f"The paper's CMA-ES leaves {PAPER_CMAES} kPa and its SBI {PAPER_SBI} kPa in A to D."
    found = weights[(weights["below"] == len(CASES)) & (weights["supported"] == len(CASES))]
    if found.empty:
        most = weights.sort_values("below").iloc[-1]
        return (
            f"{printed} SBI below CMA-ES in all four comes out under none of the {len(weights)} choices; "
            f"at most in {int(most['below'])} of {int(most['supported'])}."
        )
    which = "; ".join(f"{_weights_of(row)} ({row['label']})" for row in records(found))
    count = f"{len(found)} of the {len(weights)} choices"
    return f"{printed} SBI below CMA-ES in all four comes out under {count}: {which}."


def _weights_of(row: Mapping[Hashable, Any]) -> str:
    return ", ".join(f"{float(row[f'{term}_weight']):g}" for term in ("mae", "correlation", "peak"))


PARTS: Final[Mapping[str, Callable[[ReadingsResults | None], str]]] = {
    "readings_tried": tried_part,
    "readings_given": given_part,
    "readings_recovery": recovery_part,
    "readings_verdicts": verdicts_part,
    "readings_weights": weights_part,
}
