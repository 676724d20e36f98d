"""A number that the paper prints, as the data file lists it, and this study's value of it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
import pandas as pd
import yaml
from pydantic import Field, model_validator

from swesbi.base.settings import Settings
from swesbi.verdict.verdict import Verdict

PAPER_VALUES: Final = Path(__file__).parent / "paper_values.yaml"
"""The data file that the package ships."""

FOUND: Final = "found"
DESIGNED: Final = "designed"
"""Where this study's value comes from: of the study, or of a choice that brought it about."""
NUMBER: Final = re.compile(r"[-+]?\d+(?:\.\d+)?")
LARGE = 1e4
"""From here on thousands are set apart by commas, as the paper does."""
NORMAL_95: float = 1.96
UNSUPPORTED: Final = "no subject is prior-supported"
Option = str | float | int | bool


class PaperRow(Settings):
    """One number of the paper, or one for each of its cases; the data file's head explains the fields."""

    quantity: str = Field(min_length=1)
    where: str = Field(min_length=1)
    paper: str = ""
    cases: dict[str, str] = {}
    value: float | None = None
    path: str = ""
    measure: str = "designed"
    of: dict[str, Option] = {}
    digits: int = Field(ge=0, le=8)
    reading: str = "configured"
    remark: str = ""
    designed: str = ""
    statement: str = ""

    @model_validator(mode="after")
    def _check_printed(self) -> Self:
        if bool(self.paper) == bool(self.cases):
            raise ValueError(f"{self.quantity}: give `paper` or `cases`, one of them")
        return self


@dataclass(frozen=True)
class PaperNumber:
    """One number of the paper; ``case`` is one of the paper's ("A"), empty for a number of the whole study.

    ``value`` is NaN where what is printed is words, ``sd`` where no standard deviation stands behind it.
    """

    row: PaperRow
    case: str
    printed: str
    value: float
    sd: float

    def option(self, name: str) -> str:
        """Return an option of the measure that is a name."""
        return str(self.row.of[name])

    @property
    def quantity(self) -> str:
        """What the number is, its case and where the paper prints it."""
        case = f", case {self.case}" if self.case else ""
        return f"{self.row.quantity}{case} [{self.row.where}]"


def read_paper() -> tuple[PaperNumber, ...]:
    """Read the paper's numbers, in the order of the file."""
    groups = yaml.safe_load(PAPER_VALUES.read_text(encoding="utf-8"))
    rows = [PaperRow.from_plain(plain) for group in groups for plain in group["rows"]]
    return tuple(
        PaperNumber(row, case, printed, value if row.value is None else row.value, sd)
        for row in rows
        for case, printed in (row.cases or {"": row.paper}).items()
        for value, sd in [numbers(printed)]
    )


def numbers(printed: str) -> tuple[float, float]:
    """Return a printed number and the sd behind it: "12.61 ± 5.55", "120,000", ">0.99"; NaN for words."""
    values = [float(text) for text in NUMBER.findall(printed.replace(",", ""))]
    return (values[0] if values else float("nan")), (values[1] if "±" in printed else float("nan"))


@dataclass(frozen=True, kw_only=True)
class Findings:
    """What was found, as the paper's statements ask for it.

    ``main`` is the experiment that stands for the paper's; verdicts are its own, in the cohort's order.
    Tables have every experiment and subject, recoveries stand by experiment. ``design`` is what the study
    was made with, nested by dotted paths (:mod:`swesbi.report.paper.study`).
    """

    cohort_title: str
    main: str
    ppc: pd.DataFrame
    posterior: pd.DataFrame
    features: pd.DataFrame
    verdicts: Mapping[str, Verdict]
    recoveries: Mapping[str, pd.DataFrame]
    design: Mapping[str, Any] = field(default_factory=dict)

    def readable(self, table: pd.DataFrame, experiment: str = "") -> pd.DataFrame:
        """Return the rows of one experiment (the main one) and of prior-supported subjects, by subject."""
        chosen = table["experiment"] == (experiment or self.main)
        return table[chosen & table["may_be_read"].astype(bool)].set_index("subject")

    def parameter(self, name: str, experiment: str = "") -> pd.DataFrame:
        """Return the posterior of one parameter in one experiment, by prior-supported subject."""
        return self.readable(self.posterior[self.posterior["parameter"] == name], experiment)


@dataclass(frozen=True)
class StudyValue:
    """A value of this study.

    ``text`` is as the table shows it; ``value`` is NaN where there is no number. ``n`` is how many things the
    value counts over, where the reading needs it.
    """

    text: str
    value: float = math.nan
    n: int = 0


class NoValueError(ValueError):
    """This study has no value of a number; the message says why."""


Measure = Callable[[Findings, PaperNumber], StudyValue]


def number(value: float, asked: PaperNumber, suffix: str = "") -> StudyValue:
    """Return a single number, shown with the decimals asked for."""
    return StudyValue(shown(value, asked.row.digits) + suffix, value)


def spread(values: Sequence[float], asked: PaperNumber) -> StudyValue:
    """Return mean and standard deviation (n - 1) of one value a prior-supported subject."""
    if not len(values):
        raise NoValueError(UNSUPPORTED)
    mean = float(np.mean(values))
    if len(values) == 1:
        return StudyValue(f"{shown(mean, asked.row.digits)} (one subject)", mean, n=1)
    sd = float(np.std(values, ddof=1))
    return StudyValue(f"{shown(mean, asked.row.digits)} ± {shown(sd, asked.row.digits)}", mean, n=len(values))


def share(count: int, total: int) -> StudyValue:
    """Return "count of total"."""
    if not total:
        raise NoValueError(UNSUPPORTED)
    return StudyValue(f"{count} of {total}", count, n=total)


def shown(value: float, digits: int) -> str:
    """Return a number with its decimals; never "-0.00"."""
    if abs(value) >= LARGE:
        return f"{value:,.{digits}f}"
    text = f"{value:.{digits}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def differ(one: float, trials: float, other: float, other_trials: float) -> bool:
    """Return whether two frequencies differ by more than 1.96 standard errors of their difference.

    The errors are those of the Agresti-Caffo interval (2000), which adds one success and one failure to each
    sample, so that a frequency of 0 or 1 has an error too.
    """
    first, second = _adjusted(one, trials), _adjusted(other, other_trials)
    error = np.sqrt(first * (1.0 - first) / (trials + 2) + second * (1.0 - second) / (other_trials + 2))
    return bool(abs(first - second) > NORMAL_95 * error)


def _adjusted(frequency: float, trials: float) -> float:
    return (frequency * trials + 1.0) / (trials + 2.0)
