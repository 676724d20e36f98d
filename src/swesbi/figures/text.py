"""Words and numbers as figures show them."""

from __future__ import annotations


def percent(fraction: float) -> str:
    """Return a fraction as percent without needless zeros: 0.9 as "90 %"."""
    return f"{100.0 * fraction:g} %"


def digits(value: float) -> str:
    """Return a number with three significant digits and a true minus: 28 as "28.0", -1104 as "−1100"."""
    rounded = float(f"{value:.3g}")
    text = f"{rounded:.0f}" if abs(rounded) >= 1000.0 else f"{value:#.3g}".removesuffix(".")
    return text.replace("-", "−")


def titled(what: str, cohort_title: str) -> str:
    """Return a figure's title, which says whose data it shows."""
    return f"{what}: {cohort_title}"


FEATURE_UNITS = {"_kpa_per_cycle": "kPa/cycle", "_kpa": "kPa", "_cycle": "cycle"}


def feature_label(name: str) -> str:
    """Return a feature's name in words: "post_peak_auc_kpa" as "post-peak AUC (kPa)"."""
    unit = ""
    for suffix, unit_of_suffix in FEATURE_UNITS.items():
        if name.endswith(suffix):
            name, unit = name.removesuffix(suffix), f" ({unit_of_suffix})"
            break
    words = name.replace("post_peak", "post-peak").split("_")
    return " ".join("AUC" if word == "auc" else word for word in words) + unit
