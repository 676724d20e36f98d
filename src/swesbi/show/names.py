"""What page, tables and figures call parameters, features and settings."""

from __future__ import annotations

import re
from typing import Final

from markupsafe import Markup, escape

from swesbi.context import CONTEXT as VARIABLES
from swesbi.parameters import THETA

PARAMETERS: Final = {parameter.name: parameter.text for parameter in THETA}
PARAMETER_UNITS: Final = {parameter.name: parameter.html_unit for parameter in THETA}
DERIVED: Final = {
    "ejection_fraction": "ejection fraction",
    "end_diastolic_volume_ml": "end-diastolic volume",
    "end_systolic_volume_ml": "end-systolic volume",
    "peak_stiffness_kpa": "peak stiffness",
    "attained_stiffness_kpa": "attained stiffness k_0(1 − exp(−k_ATP D_T))",
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
FEATURE_UNITS = {"_kpa_per_cycle": "kPa/cycle", "_kpa": "kPa", "_cycle": "cycle"}


def quantity(name: str) -> str:
    """Return a quantity of the posterior table in words; an unknown one by its own name."""
    return PARAMETERS.get(name) or DERIVED.get(name) or name.replace("_", " ")


def component(name: str) -> str:
    """Return a component of the conditioning vector in words: a feature or an entry of the context."""
    if name in CONTEXT:
        return CONTEXT[name]
    return feature_label(name).split(" (")[0]


def feature_unit(name: str) -> str:
    """Return the unit that ends a feature's name."""
    return next((unit for suffix, unit in FEATURE_UNITS.items() if name.endswith(suffix)), "1")


def rejection(reason: str) -> str:
    """Return why a sample was rejected, in words."""
    return REJECTIONS.get(reason, reason.replace("_", " "))


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


def feature_label(name: str) -> str:
    """Return a feature's name in words: "post_peak_auc_kpa" as "post-peak AUC (kPa)"."""
    unit = ""
    for suffix, unit_of_suffix in FEATURE_UNITS.items():
        if name.endswith(suffix):
            name, unit = name.removesuffix(suffix), f" ({unit_of_suffix})"
            break
    words = name.replace("post_peak", "post-peak").split("_")
    return " ".join("AUC" if word == "auc" else word for word in words) + unit
