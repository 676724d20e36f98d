"""A cohort of any size in one figure: every answer, what it goes with, verdicts, weights, known truth."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.artefacts import UnfitError
from swesbi.artefacts.typed import BySubject
from swesbi.base.arrays import FloatArray
from swesbi.checks.truths import Truths
from swesbi.parameters import PHI_LABELS, PHI_NAMES, THETA_NAMES
from swesbi.prior import JointPriorSettings
from swesbi.recording.settings import ContextRow
from swesbi.report.figures.density import prior_band
from swesbi.report.figures.forest import ENDS, Series, intervals
from swesbi.report.figures.style import (
    OBSERVED,
    PRIOR,
    REFUSED_COLOR,
    STATUS_COLORS,
    Drawing,
    few_ticks,
    new_figure,
    plain,
    plain_decades,
    shared_legend,
    style,
    titled,
)
from swesbi.report.numbers import as_percent, share
from swesbi.verdict.summary import (
    OUTCOMES,
    REFUSED,
    SEPARATOR,
    CohortTable,
    answer_summary,
    cohort_table,
    is_exact,
)
from swesbi.verdict.verdict import Verdict

LOGGER = logging.getLogger("swesbi")
SIZE_IN: Final = (7.2, 7.0)
WIDE: Final = 1.9
CONTEXT: Final = {"hr_bpm": "heart rate (1/min)", "age_years": "age (years)", "lvedv_ml": "LVEDV (mL)"}
MOST_NAMED: Final = 24
LONGEST_LEVEL_NAME: Final = 3
MARGIN: Final = 1.15  # of a logarithmic axis, as a factor
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

    def limits(self, j: int) -> tuple[float, float]:
        """Return limits that hold all answers of a parameter, all truths and the prior's central mass."""
        answers = self.answered[[f"{PHI_NAMES[j]}_{end}" for end in ENDS]].to_numpy(dtype=float)
        truths = [float(truth[j]) for truth in self.truth.values() if j < len(THETA_NAMES)]
        together = np.concatenate([prior_band(self.prior)[:, j], answers.ravel(), truths])
        return float(together.min()) / MARGIN, float(together.max()) * MARGIN


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

    The legend counts the verdicts; every cohort gives the same size.

    Args:
        overview: What is shown.
        cohort_title: What the subjects are ("virtual volunteers").
        experiment: Name of the experiment.
    """
    columns, rows = 1 + len(CONTEXT) + bool(overview.truth), len(PHI_NAMES)
    with style():
        figure = new_figure(*SIZE_IN)
        grid = figure.add_gridspec(rows, columns, width_ratios=[WIDE] + [1.0] * (columns - 1))
        for j in range(rows):
            truth = bool(overview.truth) and j < len(THETA_NAMES)
            count = 1 + len(CONTEXT) + truth
            _draw_row([figure.add_subplot(grid[j, i]) for i in range(count)], overview, j, truth=truth)
        named = [figure.axes[0], figure.axes[columns - 1]]
        median = overview.answered["efficiency"].median()
        weights = f", efficiency of the weights {share(median, 0)} (median)" if median == median else ""
        what = f"Answers of the experiment '{experiment}'{weights}"
        figure.suptitle(titled(what, cohort_title), fontsize=7.5)
        refused = int((overview.table["status"] == REFUSED).sum())
        if refused:
            named[0].plot([], [], "o", ms=3.0, mew=0, color=REFUSED_COLOR, label=f"refused ({refused})")
        shared_legend(figure, named, entries_a_row=4)
    return figure


def _draw_row(panels: Sequence[Axes], overview: Overview, j: int, *, truth: bool) -> None:
    """Draw one parameter in all its panels, on one logarithmic axis, and label the last row's."""
    shown, name, limits = overview.answered, PHI_NAMES[j], overview.limits(j)
    _draw_in_order(panels[0], shown, name)
    for axes, column in zip(panels[1:], CONTEXT, strict=False):
        _draw_against(axes, shown, shown[column].to_numpy(dtype=float), name)
        axes.xaxis.set_major_locator(few_ticks(integer=True))
    if truth:
        _draw_against_truth(panels[-1], overview, j, limits)
    for axes in panels:
        band = prior_band(overview.prior)[:, j]
        axes.axhspan(*band, color=PRIOR, alpha=0.16, lw=0, zorder=0, label="prior, central 90 %")
        axes.set_yscale("log")
        axes.set_ylim(*limits)
        plain_decades(axes.yaxis)
        axes.tick_params(labelleft=axes is panels[0])
    panels[0].set_ylabel(PHI_LABELS[j].replace(" (", "\n("))
    if j == 0:
        panels[0].set_title(f"median, {as_percent(overview.interval)} interval")
        if truth:
            panels[-1].set_title("against the truth")
    if j == len(THETA_NAMES) - 1 and truth:
        panels[-1].set_xlabel("truth")
    if j == len(PHI_NAMES) - 1:
        panels[0].set_xlabel(f"{len(shown)} subjects, sorted in each panel")
        for axes, label in zip(panels[1:], CONTEXT.values(), strict=False):
            axes.set_xlabel(label)


def _draw(axes: Axes, shown: pd.DataFrame, x: FloatArray, name: str, **look: Any) -> None:  # noqa: ANN401
    """Draw the answers for a parameter at places along x, coloured by verdict."""
    answers = pd.DataFrame({end: shown[f"{name}_{end}"].to_numpy(dtype=float) for end in ENDS})
    answers = answers.assign(row=x, series=shown["status"].to_numpy())
    number = shown["status"].value_counts()
    series = {
        status: Series(color, f"{status} ({number.get(status, 0)})", lane="all", **look)
        for status, color in STATUS_COLORS.items()
    }
    intervals(axes, answers, series, upright=True)


def _draw_in_order(axes: Axes, shown: pd.DataFrame, name: str) -> None:
    """Draw medians in ascending order with their intervals; names where there are few."""
    ordered = shown.sort_values(f"{name}_median", kind="stable")
    width = float(np.clip(60.0 / max(len(ordered), 1), 0.25, 1.8))
    position = np.arange(len(ordered), dtype=float)
    _draw(axes, ordered, position, name, alpha=0.6, width=width, size=float(np.clip(3.0 * width, 1.2, 2.4)))
    axes.set_xlim(-0.8, max(len(ordered), 1) - 0.2)
    if len(ordered) > MOST_NAMED:
        axes.xaxis.set_major_locator(few_ticks(integer=True))
        return
    names = [plain(subject) for subject in ordered["subject"]]
    upright = any(len(each) > LONGEST_LEVEL_NAME for each in names)
    axes.set_xticks(position, names, rotation=90.0 if upright else 0.0, fontsize=5.5)
    axes.tick_params(axis="x", length=0)


def _draw_against(axes: Axes, shown: pd.DataFrame, x: FloatArray, name: str) -> None:
    """Draw medians against another value of each subject, intervals light behind them."""
    _draw(axes, shown, x, name, alpha=0.22, width=0.5, size=3.0 if len(shown) <= MOST_NAMED else 1.9)


def _draw_against_truth(axes: Axes, overview: Overview, j: int, limits: tuple[float, float]) -> None:
    """Draw answers against the truth; the passive stiffness has none, as the truth has another law."""
    shown = overview.answered[overview.answered["subject"].isin(list(overview.truth))]
    values = np.array([overview.truth[subject][j] for subject in shown["subject"]], dtype=float)
    _draw_against(axes, shown, values, PHI_NAMES[j])
    axes.plot(limits, limits, color=OBSERVED, lw=0.6, ls="--", label="answer = truth")
    axes.set_xscale("log")
    axes.set_xlim(*limits)
    plain_decades(axes.xaxis)


def counted_reasons(table: pd.DataFrame) -> dict[str, int]:
    """Return in how many subjects each test contradicts the model, and how many are refused."""
    refused = table["status"] == REFUSED
    counts = Counter(
        reason for reasons in table.loc[~refused, "reason"] if reasons for reason in reasons.split(SEPARATOR)
    )
    if refused.any():
        counts[OUTSIDE] = int(refused.sum())
    return dict(sorted(counts.items(), key=lambda item: (-item[1], item[0])))
