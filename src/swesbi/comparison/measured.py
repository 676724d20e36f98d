"""This study's value of one of the paper's numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from swesbi.comparison.results import StudyResults
from swesbi.tables.paper_values import Option

NAN = float("nan")
LARGE = 1e4
"""From here on thousands are set apart by commas, as the paper does."""


@dataclass(frozen=True)
class Measured:
    """A value of this study.

    Attributes:
        text: As the table shows it.
        value: The number; NaN where there is none.
        sd: Standard deviation over the supported subjects; NaN where there is none.
        n: How many things the value counts over, where the reading needs it.
        several: Values of several subjects, where the paper has one.
        missing: Why there is no value; empty where there is one.
    """

    text: str
    value: float = NAN
    sd: float = NAN
    n: int = 0
    several: tuple[float, ...] = ()
    missing: str = ""


@dataclass(frozen=True)
class Asked:
    """What is asked of a measure: the options of the row, its decimals, and the case, if it is of one."""

    of: Mapping[str, Option]
    digits: int
    case: str = ""

    def option(self, name: str) -> str:
        """Return an option that is a name.

        Raises:
            KeyError: The row has no such option.
        """
        return str(self.of[name])


Measure = Callable[[StudyResults, Asked], Measured]


def number(value: float, asked: Asked, suffix: str = "") -> Measured:
    """Return a single number, shown with the decimals asked for."""
    return Measured(shown(value, asked.digits) + suffix, value)


def spread(values: Sequence[float], asked: Asked) -> Measured:
    """Return mean and standard deviation (n - 1) of one value a supported subject."""
    if not len(values):
        return absent("no subject is supported")
    mean = float(np.mean(values))
    if len(values) == 1:
        return Measured(f"{shown(mean, asked.digits)} (one subject)", mean, n=1)
    sd = float(np.std(values, ddof=1))
    return Measured(f"{shown(mean, asked.digits)} ± {shown(sd, asked.digits)}", mean, sd, len(values))


def share(count: int, total: int) -> Measured:
    """Return "count of total"."""
    return Measured(f"{count} of {total}", count, n=total) if total else absent("no subject is supported")


def absent(why: str) -> Measured:
    """Return that there is no value, and why."""
    return Measured(f"none: {why}", missing=why)


def shown(value: float, digits: int) -> str:
    """Return a number with its decimals; never "-0.00"."""
    if abs(value) >= LARGE:
        return f"{value:,.{digits}f}"
    text = f"{value:.{digits}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text
