"""Numbers as they are shown everywhere: rounded, with a true minus, and a dash where there is none."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

MISSING: Final = "–"
MINUS: Final = "−"


def fixed(value: float, decimals: int) -> str:
    """Return a number with so many decimals: -0.8432 with two as "−0.84"."""
    return MISSING if math.isnan(value) else _signed(f"{value:.{decimals}f}")


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


def estimate(value: float, low: float, high: float) -> tuple[str, str]:
    """Return a value and its interval, to three significant digits or more where the interval is narrow.

    Two digits of the interval's width are kept, so that its ends differ: 53.7 within 53.52 and 53.83 as
    "53.70" and "53.52 to 53.83".
    """
    if math.isnan(value):
        return MISSING, MISSING
    decimals = _decimals(value, 3)
    if high > low:
        decimals = max(decimals, _decimals(high - low, 2))
    shown, start, end = (_signed(f"{number:,.{decimals}f}") for number in (value, low, high))
    return shown, span(start, end)


def percent(fraction: float, decimals: int = 1) -> str:
    """Return a fraction in percent, without the sign, which the heading has: 0.905 as "90.5"."""
    return fixed(100.0 * fraction, decimals)


def share(fraction: float, decimals: int = 1) -> str:
    """Return a fraction in percent with the sign, as sentences have it: 0.905 as "90.5 %"."""
    return MISSING if math.isnan(fraction) else f"{percent(fraction, decimals)} %"


def as_percent(fraction: float) -> str:
    """Return a level as percent without needless zeros: 0.9 as "90 %"."""
    return f"{100.0 * fraction:g} %"


def count(value: float) -> str:
    """Return a whole number with thousands apart."""
    return f"{int(value):,}"


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
