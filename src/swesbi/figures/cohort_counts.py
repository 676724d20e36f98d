"""Counts over a cohort: verdicts, what speaks against the model, and how efficient the weights are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator, PercentFormatter

from swesbi.evaluation.verdict import STATUSES
from swesbi.figures.style import OBSERVED, PRIOR, STATUS_COLORS
from swesbi.population.cohort import OUTCOMES, REFUSED, SEPARATOR

COLORS: Final = {**STATUS_COLORS, REFUSED: "#BDBDBD"}
MOST_TESTS: Final = 7
BINS: Final = 20
OUTSIDE: Final = "outside the declared range"


def draw(panels: Sequence[Axes], table: pd.DataFrame) -> None:
    """Draw shares of verdicts, the commonest reasons, and the efficiency of the weights, left to right."""
    counts = {name: int((table["status"] == name).sum()) for name in OUTCOMES}
    total = max(len(table), 1)
    shares = {f"{name}: {count} ({100.0 * count / total:.0f} %)": count for name, count in counts.items()}
    _bars(panels[0], shares, list(COLORS.values()))
    panels[0].set_title("verdicts")
    panels[0].set_xlabel("subjects")
    reasons = counted_reasons(table)
    _bars(panels[1], dict(list(reasons.items())[:MOST_TESTS]) or {"none": 0}, [PRIOR])
    panels[1].set_title("what speaks against the model")
    panels[1].set_xlabel("subjects")
    _efficiency(panels[2], table)


def counted_reasons(table: pd.DataFrame) -> dict[str, int]:
    """Return in how many subjects each test speaks against the model, and how many are refused."""
    refused = table["status"] == REFUSED
    found = Counter(
        reason for reasons in table.loc[~refused, "reason"] if reasons for reason in reasons.split(SEPARATOR)
    )
    if refused.any():
        found[OUTSIDE] = int(refused.sum())
    return dict(sorted(found.items(), key=lambda item: (-item[1], item[0])))


def _bars(axes: Axes, counts: Mapping[str, int], colors: Sequence[str]) -> None:
    """Draw horizontal bars, each with its name above it, so that names take no room beside them."""
    position = np.arange(len(counts), dtype=float)
    looks = list(colors) if len(colors) == len(counts) else colors[0]
    axes.barh(position, list(counts.values()), height=0.3, color=looks, align="center")
    for place, (name, count) in enumerate(counts.items()):
        text = name if ":" in name else f"{name}: {count}"
        axes.text(0.0, place - 0.2, text, fontsize=5.6, va="bottom", ha="left")
    axes.set_ylim(len(counts) - 0.6, -0.85)
    axes.set_xlim(0.0, max(1.0, *counts.values()) * 1.05)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.xaxis.set_major_locator(MaxNLocator(4, integer=True))


def _efficiency(axes: Axes, table: pd.DataFrame) -> None:
    answered = table[table["status"] != REFUSED]
    parts = [
        answered.loc[answered["status"] == name, "efficiency"].to_numpy(dtype=float) for name in STATUSES
    ]
    edges = np.linspace(0.0, 1.0, BINS + 1).tolist()
    axes.hist(parts, bins=edges, stacked=True, color=[STATUS_COLORS[name] for name in STATUSES])
    if len(answered):
        median = float(np.median(np.concatenate(parts)))
        axes.axvline(median, color=OBSERVED, lw=0.8, ls="--")
        axes.set_title(f"efficiency, median {100.0 * median:.0f} %")
    axes.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=0, symbol=" %"))
    axes.yaxis.set_major_locator(MaxNLocator(4, integer=True))
    axes.set_xlim(0.0, 1.0)
    by_mcmc = int((answered["sampler"] == "mcmc").sum())
    axes.set_xlabel(f"of the weights; {by_mcmc} by MCMC")
