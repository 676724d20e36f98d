"""Names and numbers as they are shown: rounded, with a true minus, and a dash where there is none."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Final

import numpy as np
import pandas as pd
from markupsafe import Markup, escape
from numpy.typing import NDArray

from swesbi.context import CONTEXT as VARIABLES
from swesbi.heart.physiology import CAPACITANCE
from swesbi.parameters import DERIVED, NUISANCES, PHI, THETA

MISSING: Final = "–"
MINUS: Final = "−"
PARAMETERS: Final = {parameter.name: parameter.text for parameter in THETA}
PARAMETER_UNITS: Final = {parameter.name: parameter.html_unit for parameter in THETA}
QUANTITY_WORDS: Final = {
    **{each.name: f"{each.title} {each.text}".strip() for each in (*PHI, *NUISANCES)},
    **{each.name: each.meaning for each in DERIVED},
    "end_diastolic_volume_ml": "end-diastolic volume",
    "end_systolic_volume_ml": "end-systolic volume",
    "peak_stiffness_kpa": "peak stiffness",
    "isometric_stiffness_kpa": "isometric stiffness k_0(1 − exp(−k_ATP D_T))",
    CAPACITANCE: "C_s",
}
CONTEXT: Final = {variable.name: variable.words for variable in VARIABLES}
SYMBOL: Final = re.compile(r"\b(k|D)_(0|ATP|SR|T)\b")
UNITS: Final = {"mhz": "MHz", "hz": "Hz", "us": "µs", "ms": "ms", "cm": "cm", "mm": "mm"}
REJECTIONS: Final = {
    "no_wave": "No wave",
    "motion": "Motion",
    "low_r2": "Low R² (scanner)",
    "bound_hit": "Bound hit",
    "empty_speed": "No speed",
    "low_fit_r2": "Low fit R²",
    "ectopic_rr": "Ectopic beat",
    "outlier": "Outlier",
    "sparse_phase": "Sparse phase",
}
DECIMALS: Final = {"mL": 0, "kPa": 1, "1": 2}
"""By unit, what a scanner can tell of a derived quantity."""
FEATURE_UNITS = {"_kpa_per_cycle": "kPa/cycle", "_kpa": "kPa", "_cycle": "cycle"}
TRAJECTORY: Final = re.compile(r"trajectory_(\d+)_kpa")
COMPONENT: Final = re.compile(
    rf"\b(?:{'|'.join(CONTEXT)}|[a-z]+(?:_[a-z0-9]+)*(?:{'|'.join(FEATURE_UNITS)}))\b"
)


def quantity(name: str) -> str:
    """Return a quantity in words or as its symbol; an unknown one by its own name."""
    return QUANTITY_WORDS.get(name) or name.replace("_", " ")


def component(name: str) -> str:
    """Return a component of the conditioning vector in words, an entry of the context or a feature.

    Examples: "hr_bpm" is "heart rate", "post_peak_auc_kpa" is "post-peak AUC".
    """
    if name in CONTEXT:
        return CONTEXT[name]
    if point := TRAJECTORY.fullmatch(name):
        return f"stiffness at point {int(point[1]) + 1} of the curve"
    suffix = next((suffix for suffix in FEATURE_UNITS if name.endswith(suffix)), "")
    words = name.removesuffix(suffix).replace("post_peak", "post-peak").split("_")
    return " ".join("AUC" if word == "auc" else word for word in words)


def feature_unit(name: str) -> str:
    """Return the unit that ends a feature's name."""
    return next((unit for suffix, unit in FEATURE_UNITS.items() if name.endswith(suffix)), "1")


def protocol_entry(key: str, value: object) -> str:
    """Return one entry of a recording protocol: push_frequency_mhz, 4.0 as "push frequency 4 MHz"."""
    *words, last = key.split("_")
    shown = f"{value:g}" if isinstance(value, float) else str(value)
    if last in UNITS:
        return f"{' '.join(words)} {shown} {UNITS[last]}"
    return f"{' '.join([*words, last])} {shown}"


def with_symbols(text: str) -> Markup:
    """Return plain text as HTML, with k_0, k_ATP, k_SR and D_T set as symbols; Markup passes as it is."""
    return Markup(SYMBOL.sub(r"<i>\1</i><sub>\2</sub>", str(escape(text))))


def svg_symbols(text: str) -> Markup:
    """Return plain text as content of an SVG text, with k_0, k_ATP, k_SR and D_T set as symbols."""
    lowered = r'<tspan font-size="10" dy="3">\2</tspan><tspan dy="-3">&#8203;</tspan>'
    symbol = rf'<tspan font-style="italic">\1</tspan>{lowered}'
    return Markup(SYMBOL.sub(symbol, str(escape(text))))


def fixed(value: float, decimals: int) -> str:
    """Return a number with so many decimals: -0.8432 with two as "−0.84"."""
    return MISSING if math.isnan(value) else _signed(f"{value:.{decimals}f}")


def with_minus(text: str) -> str:
    """Return a number that is a text with a true minus; other text passes."""
    return f"{MINUS}{text[1:]}" if text[:1] == "-" and text[1:2].isdigit() else text


def in_sentences(text: str) -> str:
    """Return a text with its components in words: "hr_bpm (z = 4.09)" as "heart rate (z = 4.09)"."""
    return COMPONENT.sub(lambda found: component(found[0]), text)


def significant(value: float, digits: int = 3) -> str:
    """Return a number with so many significant digits, never in exponents: 0.01234 as "0.0123"."""
    if math.isnan(value):
        return MISSING
    if value == 0.0 or math.isinf(value):
        return _signed(f"{value:g}")
    rounded = float(f"{value:.{digits - 1}e}")
    return _signed(f"{rounded:,.{_decimals(rounded, digits)}f}")


def digits(value: float) -> str:
    """Return three significant digits for a figure, thousands unparted: 28 as "28.0", -1104 as "−1100"."""
    rounded = float(f"{value:.3g}")
    text = f"{rounded:.0f}" if abs(rounded) >= 1000.0 else f"{value:#.3g}".removesuffix(".")
    return text.replace("-", MINUS)


def estimate(value: float, low: float, high: float, *, derived: str = "") -> tuple[str, str]:
    """Return a value and its interval, to three significant digits or more where the interval is narrow.

    Two digits of the interval's width are kept, so that its ends differ: 53.7 within 53.52 and 53.83 as
    "53.70" and "53.52 to 53.83". A derived quantity, by its unit, has no more than can be measured.
    """
    if math.isnan(value):
        return MISSING, MISSING
    decimals = _decimals(value, 3)
    if high > low:
        decimals = max(decimals, _decimals(high - low, 2))
    decimals = min(decimals, DECIMALS.get(derived, decimals))
    shown, start, end = (_signed(f"{number:,.{decimals}f}") for number in (value, low, high))
    return shown, span(start, end)


def middle(value: float, low: float, high: float, derived: str = "") -> str:
    """Return the value of :func:`estimate`."""
    return estimate(value, low, high, derived=derived)[0]


def interval(value: float, low: float, high: float, derived: str = "") -> str:
    """Return the interval of :func:`estimate`."""
    return estimate(value, low, high, derived=derived)[1]


def with_limits(value: float, low: float, high: float) -> str:
    """Return a value and its interval as one text: "53.7 (52.0 to 55.1)"; one dash where there is none."""
    shown, ends = estimate(value, low, high)
    return shown if shown == MISSING else f"{shown} ({ends})"


def yes_or_no(value: object) -> str:
    """Return a truth of a table read from CSV in words; a column with gaps holds texts, others truths."""
    return {"True": "yes", "False": "no"}.get(str(value), MISSING)


def percent(fraction: float, decimals: int = 1) -> str:
    """Return a fraction in percent, without the sign, which the heading has: 0.905 as "90.5"."""
    return fixed(100.0 * fraction, decimals)


def share(fraction: float, decimals: int = 1) -> str:
    """Return a fraction in percent with the sign, as sentences have it: 0.905 as "90.5 %"."""
    return MISSING if math.isnan(fraction) else f"{percent(fraction, decimals)} %"


def as_percent(fraction: float) -> str:
    """Return a level as percent without needless zeros: 0.9 as "90 %"."""
    return f"{100.0 * fraction:g} %"


def formatted(value: float, form: str) -> str:
    """Return a number by a format: decimals "2f", percent "1%", significant digits "3g", a count "d"."""
    if form == "d":
        return count(value)
    digits, kind = int(form[:-1]), form[-1]
    if kind == "g":
        return significant(value, digits)
    return percent(value, digits) if kind == "%" else fixed(value, digits)


def count(value: float) -> str:
    """Return a whole number with thousands apart."""
    return MISSING if math.isnan(value) else f"{int(value):,}"


def span(low: str, high: str) -> str:
    """Return an interval from two formatted numbers; one dash where both are missing."""
    return MISSING if low == high == MISSING else f"{low} to {high}"


def mean_sd(values: Sequence[float] | NDArray[np.float64] | pd.Series, decimals: int) -> str:
    """Return mean ± sample standard deviation of the known; the mean alone of one value, a dash of none."""
    known = np.asarray(values, dtype=np.float64)
    known = known[~np.isnan(known)]
    if not len(known):
        return MISSING
    mean = fixed(float(known.mean()), decimals)
    return f"{mean} ± {fixed(float(known.std(ddof=1)), decimals)}" if len(known) > 1 else mean


def _decimals(value: float, digits: int) -> int:
    """Return the decimals that show so many significant digits of a value."""
    return max(digits - 1 - math.floor(math.log10(abs(value))), 0) if value else digits - 1


def _signed(text: str) -> str:
    """Replace the hyphen by a minus; a zero has no sign."""
    negative = text.startswith("-") and any(digit in text for digit in "123456789")
    return (MINUS if negative else "") + text.removeprefix("-")
