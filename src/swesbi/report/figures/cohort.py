"""A cohort of any size in one figure: every answer, what it goes with, verdicts, weights, known truth."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, ScalarFormatter
from numpy.typing import NDArray

from swesbi.artefacts import UnfitError
from swesbi.artefacts.typed import BySubject
from swesbi.checks.truths import Truths
from swesbi.parameters import OF_INTEREST, PHI_LABELS, PHI_NAMES, THETA_NAMES
from swesbi.prior import JointPriorSettings, quantile
from swesbi.recording.settings import ContextRow
from swesbi.report.figures.style import (
    OBSERVED,
    PRIOR,
    STATUS_COLORS,
    Drawing,
    in_percent,
    new_figure,
    plain_decades,
    shared_legend,
    style,
    titled,
)
from swesbi.report.numbers import as_percent, fixed, share
from swesbi.verdict.summary import (
    OUTCOMES,
    REFUSED,
    SEPARATOR,
    CohortTable,
    answer_summary,
    cohort_table,
    is_exact,
)
from swesbi.verdict.verdict import STATUSES, Verdict

LOGGER = logging.getLogger("swesbi")
FloatArray = NDArray[np.float64]
WIDTH_IN: Final = 7.2
HEIGHT_IN: Final = 8.0
WIDE: Final = 1.9
COUNTS: Final = 1.05
CONTEXT: Final = {"hr_bpm": "heart rate (1/min)", "age_years": "age (years)", "lvedv_ml": "LVEDV (mL)"}
MOST_NAMED: Final = 24
LONGEST_LEVEL_NAME: Final = 3
PRIOR_TAIL: Final = 0.05
MARGIN: Final = 1.15  # of a logarithmic axis, as a factor
ANSWER: Final = ("low", "median", "high")
LIGHT: Final = 0.22  # opacity of intervals behind their medians
COLORS: Final = {**STATUS_COLORS, REFUSED: "#BDBDBD"}
MOST_TESTS: Final = 7
BINS: Final = 20
OUTSIDE: Final = "outside the declared range"


@dataclass(frozen=True)
class Overview:
    """What the figure shows.

    Attributes:
        table: Rows of ``cohort.csv``.
        truth: True theta (3,) of the subjects of a generated cohort; empty for a recorded one.
        prior: The joint prior, drawn for scale.
        interval: Mass of the credible intervals.
    """

    table: pd.DataFrame
    truth: Mapping[str, FloatArray]
    prior: JointPriorSettings
    interval: float

    @property
    def answered(self) -> pd.DataFrame:
        """The subjects that are not refused."""
        return self.table[self.table["status"] != REFUSED]

    @property
    def prior_band(self) -> FloatArray:
        """The prior's central 90 % of each parameter that is reported; shape (2, 4)."""
        levels = np.repeat([[PRIOR_TAIL], [1.0 - PRIOR_TAIL]], len(self.prior.names), axis=1)
        return quantile(levels, self.prior)[:, OF_INTEREST]


class CohortOutputs(NamedTuple):
    """Every subject of a cohort, in one table and one figure."""

    cohort: CohortTable
    figure: Drawing


def population_cohort(
    verdicts: BySubject[Verdict],
    truth: Truths | None,
    *,
    cohort_contexts: tuple[ContextRow, ...],
    refused: dict[str, str],
    joint_prior: JointPriorSettings,
    interval: float,
    cohort_title: str,
    experiment: str,
) -> CohortOutputs:
    """Tabulate and draw every subject of a cohort as a population's network answers it.

    Args:
        verdicts: Of every subject that is answered.
        truth: True parameters of a generated cohort.
        cohort_contexts: All subjects, in the cohort's order.
        refused: Reasons, by subject.
        joint_prior: Drawn for scale.
        interval: Mass of the credible intervals.
        cohort_title: What the subjects are called.
        experiment: Name of the experiment.

    Raises:
        UnfitError: A verdict is not of an experiment on speeds.
        ArtefactError: A subject has neither an answer nor a reason.
    """
    answers = {}
    for subject, verdict in verdicts.items():
        if not is_exact(verdict):
            raise UnfitError("verdicts", f"that of {subject} is not of an experiment on speeds")
        answers[subject] = answer_summary(verdict)
    table = cohort_table([row.to_context() for row in cohort_contexts], answers, refused)
    overview = Overview(table, truth or {}, joint_prior, interval)
    counts = table["status"].value_counts()
    LOGGER.info("%s", ", ".join(f"{counts[name]} {name}" for name in OUTCOMES if name in counts))
    return CohortOutputs(table, draw_cohort(overview, cohort_title, experiment))


def draw_cohort(overview: Overview, cohort_title: str, experiment: str) -> Figure:
    """Draw a row a parameter: answers in order of their medians, against context, and against a known truth.

    Below are verdicts, their reasons, and the efficiency of the weights. Every cohort gives the same size.

    Args:
        overview: What is shown.
        cohort_title: What the subjects are ("virtual volunteers").
        experiment: Name of the experiment.
    """
    columns = 1 + len(CONTEXT) + bool(overview.truth)
    with style():
        figure = new_figure(WIDTH_IN, HEIGHT_IN)
        rows = len(PHI_NAMES)
        grid = figure.add_gridspec(
            rows + 1,
            columns,
            width_ratios=[WIDE] + [1.0] * (columns - 1),
            height_ratios=[1.0] * rows + [COUNTS],
        )
        panels = np.array([[figure.add_subplot(grid[j, i]) for i in range(columns)] for j in range(rows)])
        for j in range(rows):
            _draw_row(list(panels[j]), overview, j)
        _label(panels, overview)
        below = [grid[rows, 0], grid[rows, 1:3], grid[rows, 3:]]
        _draw_counts([figure.add_subplot(place) for place in below], overview.table)
        figure.suptitle(titled(f"Answers of the experiment '{experiment}'", cohort_title), fontsize=7.5)
        shared_legend(figure, [panels[0, 0], panels[0, -1]], entries_a_row=5)
    return figure


def _draw_row(panels: Sequence[Axes], overview: Overview, j: int) -> None:
    """Draw one parameter in all its panels, on one logarithmic axis."""
    shown, name = overview.answered, PHI_NAMES[j]
    _in_order(panels[0], shown, name)
    for axes, column in zip(panels[1:], CONTEXT, strict=False):
        _against(axes, shown, shown[column].to_numpy(dtype=float), name)
        axes.xaxis.set_major_locator(MaxNLocator(4, integer=True))
    limits = _limits(overview, j)
    if overview.truth:
        _against_truth(panels[-1], overview, j, limits)
    for axes in panels:
        if axes.axison:
            _scale(axes, overview.prior_band[:, j], limits, labelled=axes is panels[0])
    panels[0].set_ylabel(PHI_LABELS[j].replace(" (", "\n("))


def _in_order(axes: Axes, shown: pd.DataFrame, name: str) -> None:
    """Draw medians in ascending order over thin intervals, and name few subjects."""
    ordered = shown.sort_values(f"{name}_median", kind="stable")
    position = np.arange(len(ordered))
    width = float(np.clip(60.0 / max(len(ordered), 1), 0.35, 1.2))
    for verdict, chosen in _by_verdict(ordered):
        color = STATUS_COLORS[verdict]
        low, median, high = (ordered.loc[chosen, f"{name}_{limit}"].to_numpy(dtype=float) for limit in ANSWER)
        axes.vlines(position[chosen], low, high, color=color, lw=width, alpha=0.6)
        axes.plot(position[chosen], median, "o", color=color, ms=min(2.4, 3.0 * width), mew=0)
        axes.plot([], [], "o", color=color, ms=3.0, mew=0, label=verdict)
    axes.set_xlim(-0.8, max(len(ordered), 1) - 0.2)
    if len(ordered) <= MOST_NAMED:
        _name(axes, ordered["subject"].tolist())
    else:
        axes.xaxis.set_major_locator(MaxNLocator(4, integer=True))


def _name(axes: Axes, names: Sequence[str]) -> None:
    """Name every position; long names stand upright, so that neighbours do not touch."""
    upright = any(len(name) > LONGEST_LEVEL_NAME for name in names)
    axes.set_xticks(range(len(names)), names, rotation=90.0 if upright else 0.0, fontsize=5.0)
    axes.tick_params(axis="x", length=0)


def _against(axes: Axes, shown: pd.DataFrame, x: FloatArray, name: str) -> None:
    """Draw medians against another value of each subject, intervals light behind them."""
    size = 3.0 if len(shown) <= MOST_NAMED else 1.9
    for verdict, chosen in _by_verdict(shown):
        color = STATUS_COLORS[verdict]
        low, median, high = (shown.loc[chosen, f"{name}_{limit}"].to_numpy(dtype=float) for limit in ANSWER)
        axes.vlines(x[chosen], low, high, color=color, lw=0.5, alpha=LIGHT)
        axes.plot(x[chosen], median, "o", color=color, ms=size, mew=0, alpha=0.85)


def _against_truth(axes: Axes, overview: Overview, j: int, limits: tuple[float, float]) -> None:
    """Draw answers against the truth; the passive stiffness has none, as the truth has another law."""
    if j >= len(THETA_NAMES):
        axes.set_axis_off()
        axes.text(0.5, 0.5, "no truth:\nanother\npassive law", ha="center", va="center", fontsize=6.0)
        return
    shown = overview.answered[overview.answered["subject"].isin(list(overview.truth))]
    values = np.array([overview.truth[subject][j] for subject in shown["subject"]], dtype=float)
    _against(axes, shown, values, PHI_NAMES[j])
    axes.plot(limits, limits, color=OBSERVED, lw=0.6, ls="--", label="answer = truth")
    axes.set_xscale("log")
    axes.set_xlim(*limits)
    a_decade = limits[1] > 10.0 * limits[0]
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)) if a_decade else MaxNLocator(3))
    axes.xaxis.set_major_formatter(ScalarFormatter())
    axes.xaxis.set_minor_formatter(NullFormatter())


def _scale(axes: Axes, band: FloatArray, limits: tuple[float, float], *, labelled: bool) -> None:
    axes.axhspan(*band, color=PRIOR, alpha=0.16, lw=0, zorder=0, label="prior, central 90 %")
    axes.set_yscale("log")
    axes.set_ylim(*limits)
    plain_decades(axes.yaxis)
    axes.tick_params(labelleft=labelled)


def _limits(overview: Overview, j: int) -> tuple[float, float]:
    """Return limits that hold all answers, all truths and the prior's central mass."""
    shown, name = overview.answered, PHI_NAMES[j]
    values = [
        overview.prior_band[:, j],
        *(shown[f"{name}_{end}"].to_numpy(dtype=float) for end in ("low", "high")),
    ]
    if j < len(THETA_NAMES):
        values.append(np.array([truth[j] for truth in overview.truth.values()], dtype=float))
    together = np.concatenate(values)
    return float(together.min()) / MARGIN, float(together.max()) * MARGIN


def _by_verdict(table: pd.DataFrame) -> list[tuple[str, NDArray[np.bool_]]]:
    masks = [(verdict, (table["status"] == verdict).to_numpy()) for verdict in STATUSES]
    return [(verdict, chosen) for verdict, chosen in masks if chosen.any()]


def _label(panels: NDArray[np.object_], overview: Overview) -> None:
    """Say once what the panels of a column have in common."""
    shown = len(overview.answered)
    panels[0, 0].set_title(f"median, {as_percent(overview.interval)} interval")
    panels[-1, 0].set_xlabel(f"{shown} subjects, sorted in each panel")
    for axes, label in zip(panels[-1, 1:], CONTEXT.values(), strict=False):
        axes.set_xlabel(label)
    if overview.truth:
        panels[0, -1].set_title("known truth")
        panels[-2, -1].set_xlabel("truth")


def _draw_counts(panels: Sequence[Axes], table: pd.DataFrame) -> None:
    """Draw shares of verdicts, the commonest reasons, and the efficiency of the weights, left to right."""
    counts = {name: int((table["status"] == name).sum()) for name in OUTCOMES}
    total = max(len(table), 1)
    percent = {name: fixed(100.0 * count / total, 0) for name, count in counts.items()}
    shares = {f"{name}: {count} ({percent[name]} %)": count for name, count in counts.items()}
    _bars(panels[0], shares, list(COLORS.values()))
    panels[0].set_title("verdicts")
    panels[0].set_xlabel("subjects")
    reasons = counted_reasons(table)
    _bars(panels[1], dict(list(reasons.items())[:MOST_TESTS]) or {"none": 0}, [PRIOR])
    panels[1].set_title("tests that contradict the model")
    panels[1].set_xlabel("subjects")
    _efficiency(panels[2], table)


def counted_reasons(table: pd.DataFrame) -> dict[str, int]:
    """Return in how many subjects each test contradicts the model, and how many are refused."""
    refused = table["status"] == REFUSED
    counts = Counter(
        reason for reasons in table.loc[~refused, "reason"] if reasons for reason in reasons.split(SEPARATOR)
    )
    if refused.any():
        counts[OUTSIDE] = int(refused.sum())
    return dict(sorted(counts.items(), key=lambda item: (-item[1], item[0])))


def _bars(axes: Axes, counts: Mapping[str, int], colors: Sequence[str]) -> None:
    """Draw horizontal bars, each with its name above it, so that names take no room beside them."""
    position = np.arange(len(counts), dtype=float)
    bar_colors = list(colors) if len(colors) == len(counts) else colors[0]
    axes.barh(position, list(counts.values()), height=0.3, color=bar_colors, align="center")
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
        axes.set_title(f"efficiency, median {share(median, 0)}")
    in_percent(axes.xaxis)
    axes.yaxis.set_major_locator(MaxNLocator(4, integer=True))
    axes.set_xlim(0.0, 1.0)
    by_mcmc = int((answered["sampler"] == "mcmc").sum())
    axes.set_xlabel(f"of the weights; {by_mcmc} by MCMC")
