"""This study's value of one of the paper's numbers: what it is made of, how it is shown and compared."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import pandas as pd

from swesbi.report.paper.values import PaperNumber
from swesbi.verdict.verdict import Verdict

NAN = float("nan")
LARGE = 1e4
"""From here on thousands are set apart by commas, as the paper does."""
NORMAL_95: float = 1.96
UNSUPPORTED: Final = "no subject is prior-supported"


@dataclass(frozen=True, kw_only=True)
class Findings:
    """What was found, as the paper's statements ask for it.

    Attributes:
        cohort_title: What the subjects are ("virtual volunteers").
        main: The experiment that stands for the paper's.
        ppc: The predictive scores of every experiment and subject.
        posterior: Medians, intervals and correlations of every experiment and subject.
        features: The checked features of every experiment and subject.
        verdicts: Verdicts of the main experiment, by subject, in the cohort's order.
        recoveries: Recovery scores by experiment.
        design: What the study was made with, nested by dotted paths (:mod:`swesbi.report.paper.design`).
    """

    cohort_title: str
    main: str
    ppc: pd.DataFrame
    posterior: pd.DataFrame
    features: pd.DataFrame
    verdicts: Mapping[str, Verdict]
    recoveries: Mapping[str, pd.DataFrame]
    design: Mapping[str, Any] = field(default_factory=dict)

    def scores(self, experiment: str = "", readable: bool = True) -> pd.DataFrame:
        """Return the scores of one experiment (the main one), by subject, if they may be interpreted."""
        table = self.ppc[self.ppc["experiment"] == (experiment or self.main)].set_index("subject")
        return table[table["may_be_read"].astype(bool)] if readable else table

    def parameter(self, name: str, experiment: str = "") -> pd.DataFrame:
        """Return the posterior of one parameter in one experiment, by prior-supported subject."""
        table = self.posterior
        chosen = (table["experiment"] == (experiment or self.main)) & (table["parameter"] == name)
        return table[chosen & table["may_be_read"].astype(bool)].set_index("subject")


@dataclass(frozen=True)
class StudyValue:
    """A value of this study.

    Attributes:
        text: As the table shows it.
        value: The number; NaN where there is none.
        sd: Standard deviation over the prior-supported subjects; NaN where there is none.
        n: How many things the value counts over, where the reading needs it.
        missing: Why there is no value; empty where there is one.
    """

    text: str
    value: float = NAN
    sd: float = NAN
    n: int = 0
    missing: str = ""


class NoValueError(ValueError):
    """This study has no value of a number; the message says why."""


Measure = Callable[[Findings, PaperNumber], StudyValue]


def number(value: float, asked: PaperNumber, suffix: str = "") -> StudyValue:
    """Return a single number, shown with the decimals asked for."""
    return StudyValue(shown(value, asked.row.digits) + suffix, value)


def spread(values: Sequence[float], asked: PaperNumber) -> StudyValue:
    """Return mean and standard deviation (n - 1) of one value a prior-supported subject.

    Raises:
        NoValueError: There is none.
    """
    if not len(values):
        raise NoValueError(UNSUPPORTED)
    mean = float(np.mean(values))
    if len(values) == 1:
        return StudyValue(f"{shown(mean, asked.row.digits)} (one subject)", mean, n=1)
    sd = float(np.std(values, ddof=1))
    return StudyValue(
        f"{shown(mean, asked.row.digits)} ± {shown(sd, asked.row.digits)}", mean, sd, len(values)
    )


def share(count: int, total: int) -> StudyValue:
    """Return "count of total".

    Raises:
        NoValueError: There is none.
    """
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

    The errors are those of the Agresti-Caffo interval (2000), which adds one success and one failure to
    each sample, so that a frequency of 0 or 1 has an error too.

    Args:
        one: Observed frequency, from 0 to 1.
        trials: Trials behind it.
        other: Another frequency.
        other_trials: Trials behind that.
    """
    first, second = _adjusted(one, trials), _adjusted(other, other_trials)
    error = np.sqrt(first * (1.0 - first) / (trials + 2) + second * (1.0 - second) / (other_trials + 2))
    return bool(abs(first - second) > NORMAL_95 * error)


def _adjusted(frequency: float, trials: float) -> float:
    return (frequency * trials + 1.0) / (trials + 2.0)
