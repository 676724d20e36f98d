"""Numbers and tables as Markdown shows them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from swesbi.virtual_cohort.readme import markdown

NONE = "–"


def fixed(value: float, decimals: int) -> str:
    """Return a number with so many decimals and a true minus; a dash for NaN."""
    if np.isnan(value):
        return NONE
    return f"{value:.{decimals}f}".replace("-", "−")


def share(fraction: float, decimals: int = 1) -> str:
    """Return a fraction in percent; a dash for NaN."""
    return NONE if np.isnan(fraction) else f"{100.0 * fraction:.{decimals}f} %"


def mean_sd(values: pd.Series, decimals: int) -> str:
    """Return mean and sample standard deviation; a dash without values, the mean alone of one."""
    known = values.dropna()
    mean, sd = fixed(known.mean(), decimals), fixed(known.std(), decimals)
    return mean if NONE in (mean, sd) else f"{mean} ± {sd}"


def table(rows: Sequence[Mapping[str, str]]) -> str:
    """Return a Markdown table of texts, its columns those of the first row."""
    return markdown(pd.DataFrame(list(rows)).fillna(NONE))
