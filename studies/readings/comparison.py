"""Readings of the paper's text beside the numbers that it prints: tables of what each comes to.

A reading's coverage is told by two intervals: the band of noiseless predictive curves, and the interval of a
new observation, under the noise of Eq. 5 put back on these curves. Everything else has one value.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pandas as pd

from studies.readings.chain import CORRELATION, RECOVERY, RMSE, SUPPORTED
from studies.readings.settings import CASES, ComparisonSettings, Reading, Treatment
from swesbi.artefacts import ArtefactError
from swesbi.parameters import THETA_NAMES
from swesbi.report.paper.values import PaperNumber

PAPER: Final = "paper"
"""Name of the paper's row."""
INTERVALS: Final = {"curve": "band of noiseless curves", "observed": "interval of a new observation"}
COVERAGE: Final = "coverage_{}"
LOWEST: Final = "D"
TOGETHER: Final = "all of them"
OF_CURVE: Final = "coverage of the 90 % predictive interval"
MEANS: Final = {
    "rmse_prior_kpa": "RMSE of the prior predictive median, mean ± sd (kPa)",
    "rmse_kpa": "RMSE of the posterior predictive median, mean ± sd (kPa)",
    "rmse_reduction_percent": "RMSE reduction, mean ± sd (%)",
    "r2": "R2, mean ± sd",
}
CORRELATIONS: Final = {
    "r_k0_k_atp": ("r(k_0, k_ATP), mean ± sd", "k0_kpa k_atp_per_s"),
    "r_k0_k_sr": ("r(k_0, k_SR), mean ± sd", "k0_kpa k_sr_per_s"),
    "r_k_atp_k_sr": ("r(k_ATP, k_SR), mean ± sd", "k_atp_per_s k_sr_per_s"),
}
RECOVERIES: Final = {
    "recovery_k0_percent": ("coverage of k_0 (%)", "k0_kpa"),
    "recovery_k_atp_percent": ("coverage of k_ATP (%)", "k_atp_per_s"),
    "recovery_k_sr_percent": ("coverage of k_SR (%)", "k_sr_per_s"),
}
PRINTED: Final[Mapping[str, tuple[str, str]]] = {
    "supported": ("subjects that pass both support criteria", ""),
    **{key: (quantity, "") for key, quantity in MEANS.items()},
    **{COVERAGE.format(case): (f"{OF_CURVE}, as the band of noiseless curves", case) for case in CASES},
    "features_inside": ("noise-modelled features inside their 90 % intervals", ""),
    **{key: (quantity, "") for key, (quantity, _) in CORRELATIONS.items()},
    **{key: (quantity, "") for key, (quantity, _) in RECOVERIES.items()},
}
"""The printed numbers that readings are set against: quantity and case of ``paper_values.yaml``.

The errors of single cases are not among them, which are other people's; nor is what a choice of the study
fixes.
"""
NUMERIC: Final = ("noise_factor", "smoothing_cycle", "passive_scale_errors", "recovery_stretch")
"""Settings of a treatment whose ranges are told."""


NumbersRow = Mapping[str, Any] | Mapping[Hashable, Any]


@dataclass(frozen=True)
class Printed:
    """One printed number: what it is called, its value, and its spread."""

    words: str
    value: float
    spread: float


def printed_numbers(paper: Sequence[PaperNumber], comparison: ComparisonSettings) -> dict[str, Printed]:
    """Return the numbers of ``PRINTED`` by key; the spread is the printed one, else a fraction of the value.

    Raises:
        ArtefactError: The paper's numbers hold no such quantity.
    """
    known = {(number.row.quantity, number.case): number for number in paper}
    if missing := [key for key in PRINTED.values() if key not in known]:
        raise ArtefactError(f"paper_values.yaml has no {missing[0][0]!r} (case {missing[0][1] or 'none'})")
    return {key: _printed(known[place], comparison) for key, place in PRINTED.items()}


def _printed(number: PaperNumber, comparison: ComparisonSettings) -> Printed:
    case = f", case {number.case}" if number.case else ""
    quantity = OF_CURVE if number.row.quantity.startswith(OF_CURVE) else number.row.quantity
    spread = comparison.spread_fraction * abs(number.value) if np.isnan(number.sd) else number.sd
    return Printed(f"{quantity}{case}", number.value, spread)


def reading_values(numbers: pd.DataFrame) -> dict[str, float]:
    """Return the values of one reading by column of the table, from its numbers; NaN where it gives none."""
    chosen = numbers[numbers["chosen"] == 1]
    by = chosen.set_index(["quantity", "of"])["value"]
    supported = by.loc[SUPPORTED]
    names = supported.index[supported == 1.0]
    values = {"supported": float(supported.sum())}
    for key in MEANS:
        values[key] = _mean([by.get((key, name)) for name in names])
    for interval in INTERVALS:
        for case in CASES:
            values[f"coverage_{interval}_{case}"] = _number(by.get((f"coverage_{interval}", case)))
    values["features_inside"] = _sum([by.get(("all_features_inside", name)) for name in names])
    values["features_inside_of_all"] = _sum([by.get(("features_inside", name)) for name in names])
    for key, (_, pair) in CORRELATIONS.items():
        values[key] = _mean([by.get((CORRELATION, f"{name} {pair}")) for name in names])
    for key, (_, parameter) in RECOVERIES.items():
        values[key] = 100.0 * _number(by.get((RECOVERY, parameter)))
    return values


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def _mean(values: Sequence[float | None]) -> float:
    return float(np.mean([_number(value) for value in values])) if values else float("nan")


def _sum(values: Sequence[float | None]) -> float:
    return float(np.sum([_number(value) for value in values])) if values else float("nan")


def value_of(row: NumbersRow, key: str, interval: str) -> float:
    """Return one compared value of a row of the table; coverages by that interval."""
    case = key.removeprefix(COVERAGE.format(""))
    column = f"coverage_{interval}_{case}" if key.startswith(COVERAGE.format("")) else key
    return float(row[column])


def deviations(
    row: NumbersRow,
    printed: Mapping[str, Printed],
    interval: str,
    comparison: ComparisonSettings,
) -> dict[str, float]:
    """Return by how many spreads each number of a reading is off, signed; one it does not give by many."""
    off = {key: (value_of(row, key, interval) - p.value) / p.spread for key, p in printed.items()}
    return {key: comparison.missing_spreads if np.isnan(value) else value for key, value in off.items()}


def given(
    row: NumbersRow,
    printed: Mapping[str, Printed],
    interval: str,
    comparison: ComparisonSettings,
) -> frozenset[str]:
    """Return the printed numbers that a reading gives: within their spread, coverages within the margin.

    The coverage of the case that the paper's is lowest in counts only where it is lowest in the reading.
    """
    found = set()
    coverages = [value_of(row, COVERAGE.format(case), interval) for case in CASES]
    for key, number in printed.items():
        value, margin = value_of(row, key, interval), number.spread
        if key.startswith(COVERAGE.format("")):
            margin = comparison.coverage_margin
            if key == COVERAGE.format(LOWEST) and value != min(coverages):
                continue
        if abs(value - number.value) <= margin * (1.0 + 1e-9):
            found.add(key)
    return frozenset(found)


def readings_table(
    numbers: Mapping[str, pd.DataFrame],
    readings: Mapping[str, Reading],
    paper: Sequence[PaperNumber],
    comparison: ComparisonSettings,
) -> pd.DataFrame:
    """Return a row a reading, the paper's own numbers on top.

    ``distance_curve`` and ``distance_observed`` are root mean squares over the printed numbers in spreads, by
    the interval of the coverages; ``given_...`` counts those of the numbers, ``of`` in all, that are given;
    ``tried`` the readings.
    """
    printed = printed_numbers(paper, comparison)
    top: dict[str, Any] = {"reading": PAPER, "label": "the paper"}
    for key, number in printed.items():
        if key.startswith(COVERAGE.format("")):
            case = key.removeprefix(COVERAGE.format(""))
            top |= {f"coverage_{interval}_{case}": number.value for interval in INTERVALS}
        else:
            top[key] = number.value
    rows = [top]
    for name, reading in readings.items():
        row: dict[str, Any] = {"reading": name, "label": reading.label} | reading_values(numbers[name])
        for interval in INTERVALS:
            off = np.array(list(deviations(row, printed, interval, comparison).values()))
            row[f"distance_{interval}"] = float(np.sqrt(np.mean(off**2)))
            row[f"given_{interval}"] = len(given(row, printed, interval, comparison))
        rows.append(row)
    return pd.DataFrame(rows, columns=list(rows[1])).assign(of=len(printed), tried=len(readings))


def closest(table: pd.DataFrame) -> tuple[pd.Series, str]:
    """Return the row of the reading with the least distance, and the interval that gives it.

    A reading that leaves out a number of any case is set aside, unless all do.
    """
    tried = table[table["reading"] != PAPER]
    whole = tried.dropna()
    ordered = {
        interval: (tried if whole.empty else whole).sort_values(f"distance_{interval}", kind="stable")
        for interval in INTERVALS
    }
    least = {name: float(rows[f"distance_{name}"].iloc[0]) for name, rows in ordered.items()}
    interval = min(least, key=least.__getitem__)
    return ordered[interval].iloc[0], interval


def given_table(
    table: pd.DataFrame,
    readings: Mapping[str, Reading],
    paper: Sequence[PaperNumber],
    comparison: ComparisonSettings,
) -> pd.DataFrame:
    """Return a row a printed number and interval: which readings give it, over which range of each setting.

    Coverages have a row for each interval, other numbers one. The nearest reading is named in any case.
    """
    printed = printed_numbers(paper, comparison)
    rows = [dict(row) for row in table[table["reading"] != PAPER].to_dict("records")]
    lines = []
    for key, number in printed.items():
        of_coverage = key.startswith(COVERAGE.format(""))
        for interval in INTERVALS if of_coverage else ("curve",):
            names = [str(r["reading"]) for r in rows if key in given(r, printed, interval, comparison)]
            values = np.array([value_of(row, key, interval) for row in rows])
            off = np.where(np.isnan(values), np.inf, np.abs(values - number.value))
            nearest = rows[int(np.argmin(off))]
            lines.append(
                {
                    "number": number.words,
                    "interval": interval if of_coverage else "",
                    "printed": number.value,
                    "margin": comparison.coverage_margin if of_coverage else number.spread,
                    "given_by": len(names),
                    "readings": "; ".join(readings[name].label for name in names),
                    "settings": "; ".join(_ranges(names, readings)),
                    "nearest": str(nearest["label"]),
                    "nearest_value": value_of(nearest, key, interval),
                }
            )
    return pd.DataFrame(lines)


def _ranges(names: Sequence[str], readings: Mapping[str, Reading]) -> Iterator[str]:
    """Yield of each numeric setting the values, changed alone, among the readings that give a number."""
    for setting in NUMERIC:
        default = getattr(Treatment(), setting)
        values = set()
        for name in names:
            reading = readings[name]
            alone = reading.treatment.model_copy(update={setting: default}) == Treatment()
            if alone and not reading.changes:
                values.add(getattr(reading.treatment, setting))
        if values - {default}:
            low, high = min(values), max(values)
            yield f"{setting} {low:g} to {high:g}" if low < high else f"{setting} {low:g}"


def recovery_table(numbers: Mapping[str, pd.DataFrame], readings: Mapping[str, Reading]) -> pd.DataFrame:
    """Return a row a reading and checkpoint: the share of intervals that contain the truth, in percent."""
    rows = []
    for name, frame in numbers.items():
        recovered = frame[frame["quantity"] == RECOVERY]
        for epoch, part in recovered.groupby("epoch", sort=True):
            values = part.set_index("of")["value"]
            line = {parameter: 100.0 * float(values[parameter]) for parameter in THETA_NAMES}
            row = {"reading": name, "label": readings[name].label, "epoch": epoch}
            rows.append(row | {"chosen": int(part["chosen"].iloc[0])} | line)
    return pd.DataFrame(rows)


def seeds_by_reading(judged: Mapping[str, pd.DataFrame], readings: Mapping[str, Reading]) -> pd.DataFrame:
    """Return a row a reading and subject: of how many recordings, how many are supported, and what fails.

    A last row, ``TOGETHER``, counts the seeds under which every subject is supported.
    """
    rows: list[dict[str, Any]] = []
    for name, frame in judged.items():
        for subject, part in frame.groupby("subject", sort=False):
            outside = part[part["within_z"] == 0]["worst_component"].dropna()
            rows.append(
                {
                    "reading": name,
                    "label": readings[name].label,
                    "subject": subject,
                    "recordings": len(part),
                    "supported": int(part["supported"].sum()),
                    "within_z": int(part["within_z"].sum()),
                    "median_max_abs_z": float(part["max_abs_z"].median()),
                    "most_often_outside": str(outside.mode().iloc[0]) if len(outside) else "",
                    "rmse_kpa": float(part["rmse_kpa"].median()),
                }
            )
        by_seed = frame.groupby("acquisition_seed")[["supported", "within_z"]].min()
        together = {"subject": TOGETHER, "recordings": len(by_seed), "most_often_outside": ""}
        counts = {column: int(by_seed[column].sum()) for column in ("supported", "within_z")}
        rows.append({"reading": name, "label": readings[name].label} | together | counts)
    return pd.DataFrame(rows)


def weights_table(
    fits: Mapping[str, pd.DataFrame],
    numbers: Mapping[str, pd.DataFrame],
    readings: Mapping[str, Reading],
) -> pd.DataFrame:
    """Return a row a reading and choice of weights: errors of CMA-ES beside those of the posterior's median.

    ``below`` counts the supported cases of A to D in which the posterior's median has the lower error.
    """
    rows = []
    for name, frame in fits.items():
        own = numbers[name][(numbers[name]["chosen"] == 1) & (numbers[name]["quantity"] == RMSE)]
        sbi = own.set_index("of")["value"]
        terms = ["mae_weight", "correlation_weight", "peak_weight"]
        for weights, part in frame.groupby(terms, sort=False):
            fitted = part.set_index("subject")["rmse_kpa"]
            both = [case for case in CASES if case in fitted.index and case in sbi.index]
            row: dict[str, Any] = {"reading": name, "label": readings[name].label}
            row |= dict(zip(terms, weights, strict=True))
            row |= {f"cmaes_{case}_kpa": _number(fitted.get(case)) for case in CASES}
            row |= {f"sbi_{case}_kpa": _number(sbi.get(case)) for case in CASES}
            row |= {"below": sum(bool(sbi[case] < fitted[case]) for case in both), "supported": len(both)}
            rows.append(row)
    return pd.DataFrame(rows)
