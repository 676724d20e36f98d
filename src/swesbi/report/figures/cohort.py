"""A whole cohort in one figure: every answer and what it goes with, and what the pressures of a cuff add."""

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
from swesbi.checks.pressures import RESISTANCE, PressuresTable
from swesbi.checks.truths import Truths
from swesbi.heart.physiology import TIME_CONSTANT, VOLUME_FACTOR
from swesbi.heart.simulate import PA_PER_MMHG
from swesbi.parameters import PEAK_ACTIVE, PHI, PHI_LABELS, PHI_NAMES, THETA_NAMES
from swesbi.prior import JointPriorSettings
from swesbi.recording.settings import ContextRow
from swesbi.report.figures.forest import ENDS, MOST_ROWS, Panel, Series, forest, intervals
from swesbi.report.figures.posterior import prior_band
from swesbi.report.figures.style import (
    EXCLUDED_POSTERIOR,
    OBSERVED,
    POSTERIOR,
    PRIOR,
    REFUSED_COLOR,
    STATUS_COLORS,
    Drawing,
    drawing,
    few_ticks,
    plain,
    plain_decades,
    shared_legend,
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
)
from swesbi.verdict.verdict import Verdict

LOGGER = logging.getLogger("swesbi")
CONTEXT: Final = {"hr_bpm": "heart rate (1/min)", "age_years": "age (years)", "lvedv_ml": "LVEDV (mL)"}
MOST_NAMED: Final = 24
LONGEST_LEVEL_NAME: Final = 3
MARGIN: Final = 1.15  # of a logarithmic axis, as a factor
OUTSIDE: Final = "outside the declared range"
TITLES: Final = {
    **{parameter.name: parameter.label for parameter in PHI},
    PEAK_ACTIVE.name: "peak active stiffness (kPa)",
    RESISTANCE: "resistance $R_d$ (mmHg s/mL)",
    TIME_CONSTANT: "time constant $R_d C_s$ (s)",
    VOLUME_FACTOR: "stressed volume factor $f_V$",
}
"""Quantities of the table of pressures with a panel each, row by row."""
SCALE: Final = {RESISTANCE: 1e-6 / PA_PER_MMHG}
"""From the unit of the table to that of the figure: Pa s/m3 to mmHg s/mL."""
PRESSURES_LOOK: Final = {
    "without": Series(EXCLUDED_POSTERIOR, "speeds alone"),
    "with": Series(POSTERIOR, "speeds and cuff pressures", marker="s"),
}


@dataclass(frozen=True)
class Overview:
    """What the figure shows: rows of ``cohort.csv``, true theta (3,) where known, the prior for scale."""

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

    ``cohort_contexts`` are all subjects in order; each has a verdict, or a reason in ``refused``.
    """
    answers = {subject: answer_summary(verdict) for subject, verdict in verdicts.items()}
    table = cohort_table([row.to_context() for row in cohort_contexts], answers, refused)
    overview = Overview(table, truth or {}, joint_prior, interval)
    counts = table["status"].value_counts()
    LOGGER.info("%s", ", ".join(f"{counts[name]} {name}" for name in OUTCOMES if name in counts))
    return CohortOutputs(table, draw_cohort(overview, cohort_title, experiment))


def draw_cohort(overview: Overview, cohort_title: str, experiment: str) -> Figure:
    """Draw a row a parameter: answers in order of their medians, against context, and against a known truth.

    The legend counts the verdicts; every cohort gives the same size.
    """
    columns, rows = 1 + len(CONTEXT) + bool(overview.truth), len(PHI_NAMES)
    median = overview.answered["efficiency"].median()
    weights = f", efficiency of the weights {share(median, 0)} (median)" if median == median else ""
    title = titled(f"Answers of the experiment '{experiment}'{weights}", cohort_title)
    with drawing(7.2, 7.0, title) as figure:
        grid = figure.add_gridspec(rows, columns, width_ratios=[1.9] + [1.0] * (columns - 1))
        for j in range(rows):
            truth = bool(overview.truth) and j < len(THETA_NAMES)
            count = 1 + len(CONTEXT) + truth
            _draw_row([figure.add_subplot(grid[j, i]) for i in range(count)], overview, j, truth=truth)
        named = [figure.axes[0], figure.axes[columns - 1]]
        refused = int((overview.table["status"] == REFUSED).sum())
        if refused:
            named[0].plot([], [], "o", ms=3.0, mew=0, color=REFUSED_COLOR, label=f"refused ({refused})")
        shared_legend(figure, named, entries_a_row=4)
    return figure


def _draw_row(panels: Sequence[Axes], overview: Overview, j: int, *, truth: bool) -> None:
    """Draw one parameter in all its panels, on one logarithmic axis, and label the last row's."""
    shown, name, limits = overview.answered, PHI_NAMES[j], overview.limits(j)
    first, last, band = j == 0, j == len(PHI_NAMES) - 1, prior_band(overview.prior)[:, j]
    _draw_in_order(panels[0], shown, name)
    panels[0].set(
        title=f"median, {as_percent(overview.interval)} interval" if first else "",
        xlabel=f"{len(shown)} subjects, sorted in each panel" if last else "",
        ylabel=PHI_LABELS[j].replace(" (", "\n("),
    )
    for axes, (column, label) in zip(panels[1:], CONTEXT.items(), strict=False):
        _draw_against(axes, shown, shown[column].to_numpy(dtype=float), name)
        axes.xaxis.set_major_locator(few_ticks(integer=True))
        axes.set_xlabel(label if last else "")
    if truth:
        _draw_against_truth(panels[-1], overview, j, limits)
        lowest = j == len(THETA_NAMES) - 1
        panels[-1].set(title="against the truth" if first else "", xlabel="truth" if lowest else "")
    for axes in panels:
        axes.axhspan(*band, color=PRIOR, alpha=0.16, lw=0, zorder=0, label="prior, central 90 %")
        plain_decades(axes.yaxis)
        axes.set_ylim(*limits)
        axes.tick_params(labelleft=axes is panels[0])


def _draw(axes: Axes, shown: pd.DataFrame, x: FloatArray, name: str, **look: Any) -> None:  # noqa: ANN401
    """Draw the answers for a parameter at places along x, coloured by verdict."""
    ends = {end: shown[f"{name}_{end}"].to_numpy(dtype=float) for end in ENDS}
    answers = pd.DataFrame({"row": x, "series": shown["status"].to_numpy(), **ends})
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
    plain_decades(axes.xaxis)
    axes.set_xlim(*limits)


def draw_pressures(table: PressuresTable, *, experiment: str, cohort_title: str) -> Drawing:
    """Draw medians and intervals without and with pressures, a panel a quantity and a row a subject."""
    table = table[table["experiment"] == experiment]
    if table.empty:
        raise UnfitError("table", f"holds no {experiment}; delete it and rerun")
    subjects = list(dict.fromkeys(table["subject"]))[:MOST_ROWS]
    shown = table[table["subject"].isin(subjects)]
    factor = shown["quantity"].map(SCALE).fillna(1.0)
    rows = pd.concat(
        shown.assign(
            row=shown["subject"], panel=shown["quantity"], series=which,
            **{end: shown[f"{which}_{end}"] * factor for end in ENDS},
        )
        for which in PRESSURES_LOOK
    )  # fmt: skip
    ratios = shown.groupby("quantity")["width_ratio"].median()
    panels = {
        name: Panel(
            title,
            label=f"width {ratios[name]:.2f} of that without" if np.isfinite(ratios[name]) else "",
            mark=1.0 if name == VOLUME_FACTOR else None,
        )
        for name, title in TITLES.items()
    }
    return forest(rows, panels, PRESSURES_LOOK, title=titled("Without and with cuff pressures", cohort_title))


def counted_reasons(table: pd.DataFrame) -> dict[str, int]:
    """Return in how many subjects each test contradicts the model, and how many are refused."""
    refused = table["status"] == REFUSED
    counts = Counter(
        reason for reasons in table.loc[~refused, "reason"] if reasons for reason in reasons.split(SEPARATOR)
    )
    if refused.any():
        counts[OUTSIDE] = int(refused.sum())
    return dict(sorted(counts.items(), key=lambda item: (-item[1], item[0])))
