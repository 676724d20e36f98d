"""The misspecification tests: p-values and verdict of every subject, false alarms, which test finds what."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from swesbi.report.figures.style import (
    CMAES,
    POSTERIOR,
    PRIOR,
    TEXT_WIDTH_IN,
    TRUTH,
    new_figure,
    style,
    titled,
)
from swesbi.report.numbers import as_percent
from swesbi.verdict.power import COHORT, STRAINED_OR_WORSE, AlarmRow
from swesbi.verdict.recordings import ACQUIRED, OWN, VOLUNTEER
from swesbi.verdict.statistics import GROUPS, TEST_NAMES
from swesbi.verdict.verdict import Status, Verdict, VerdictTest

ROW_IN: Final = 0.26
RATES_IN: Final = 2.1
MARGINS_IN: Final = 1.75
SMALLEST_SHOWN: Final = 1e-4
WELL_SPECIFIED: Final = 2  # bars of well-specified recordings
STATUS_COLORS: Final = {
    Status.NOT_CONTRADICTED: TRUTH,
    Status.UNINFORMATIVE: PRIOR,
    Status.STRAINED: "#E69F00",
    Status.CONTRADICTED: CMAES,
}
GROUP_COLORS: Final = dict(zip(GROUPS, ("#56B4E9", "#CC79A7", POSTERIOR), strict=True))
GROUP_LABELS: Final = dict(
    zip(GROUPS, ("not what the prior predicts", "not what the fit predicts", "at a bound"), strict=True)
)
LABELS: Final = {
    "mahalanobis": "Mahalanobis",
    "nearest_neighbours": "nearest neighbours",
    "mmd": "MMD",
    "chi2": r"$\chi^2$",
    "peak": "peak",
    "time_to_peak": "time to peak",
    "decay": "decay slope",
    "conditional_features": "unlikeliest feature",
    "boundary_mass": "boundary mass",
    "context_leave_one_out": "context, others",
    "context_ranges": "values out of range",
    "end_diastolic_volume": "LVEDV (z)",
    "end_systolic_volume": "LVESV (z)",
    "ejection_time": "LVET (z)",
}


def draw_misspecification(
    verdicts: Mapping[str, Verdict], rows: Sequence[AlarmRow], level: float, cohort_title: str
) -> Figure:
    """Draw p-values and verdicts above, rates of alarms below.

    Args:
        verdicts: Verdict of each subject, in the order of the figure; all of an experiment on speeds.
        rows: The rates of all alarms.
        level: False-alarm rate that the rule is to keep.
        cohort_title: What the subjects are ("virtual volunteers").

    Raises:
        ValueError: There is no subject.
    """
    if not verdicts:
        raise ValueError("no subject to draw: the cohort is empty")
    with style():
        height = MARGINS_IN + ROW_IN * len(verdicts) + RATES_IN
        figure = new_figure(TEXT_WIDTH_IN * 1.25, height)
        table, rates = figure.subplots(2, 1, height_ratios=(ROW_IN * len(verdicts), RATES_IN))
        _draw_verdicts(table, verdicts)
        _draw_rates(rates, rows, level)
        figure.suptitle(titled("Misspecification tests", cohort_title), fontsize=7.5)
    return figure


def _draw_verdicts(axes: Axes, verdicts: Mapping[str, Verdict]) -> None:
    """Draw one row a subject and one column a test; darker is less likely, a frame is a flag."""
    names = _columns(verdicts)
    shade = Normalize(0.0, -np.log10(SMALLEST_SHOWN))
    for row, verdict in enumerate(verdicts.values()):
        outcomes = {test.name: test for test in verdict.tests}
        for column, name in enumerate(names):
            if name in outcomes:
                _draw_cell(axes, column, row, outcomes[name], shade)
        word = verdict.status
        color = STATUS_COLORS[word]
        axes.text(len(names) - 0.3, row, word, color=color, va="center", fontweight="bold", fontsize=6.5)
    axes.set_xlim(-0.5, len(names) + 1.6)
    axes.set_ylim(len(verdicts) - 0.5, -0.5)
    axes.set_yticks(range(len(verdicts)), list(verdicts))
    axes.set_xticks(range(len(names)), [LABELS.get(name, name) for name in names], rotation=90.0)
    axes.set_xlabel(
        "p-values against well-specified recordings; framed: flagged; no shade: no null distribution"
    )
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _draw_cell(axes: Axes, column: int, row: int, test: VerdictTest, shade: Normalize) -> None:
    """Draw a p-value shaded by its size, or the statistic of a test without one."""
    face, ink, text = "white", "black", _statistic_text(test)
    if test.p_value is not None:
        depth = float(shade(-np.log10(max(test.p_value, SMALLEST_SHOWN))))
        face, ink = str(1.0 - 0.75 * depth), "white" if depth > 0.6 else "black"
        text = _p_text(test.p_value)
    edge, width = (CMAES, 1.4) if test.flagged else ("white", 0.8)
    box = (column - 0.46, row - 0.44)
    axes.add_patch(Rectangle(box, 0.92, 0.88, facecolor=face, edgecolor=edge, lw=width))
    axes.text(column, row, text, ha="center", va="center", color=ink, fontsize=5.8)


def _draw_rates(axes: Axes, rows: Sequence[AlarmRow], level: float) -> None:
    """Draw the share of recordings on which each group of tests, and all together, raise an alarm."""
    shown = _recordings(rows)
    by_alarm = {(row.subject, row.recordings, row.alarm): row for row in rows}
    alarms = [(f"group: {group}", GROUP_COLORS[group], GROUP_LABELS[group]) for group in GROUPS]
    alarms += [
        (STRAINED_OR_WORSE, STATUS_COLORS[Status.STRAINED], "verdict: strained or contradicted"),
        (Status.CONTRADICTED, STATUS_COLORS[Status.CONTRADICTED], "verdict: contradicted"),
    ]
    width = 0.8 / len(alarms)
    for which, (alarm, color, label) in enumerate(alarms):
        alarm_rows = [by_alarm[(subject, kind, alarm)] for subject, kind in shown]
        x = np.arange(len(alarm_rows)) + (which - 0.5 * (len(alarms) - 1)) * width
        rate = np.array([row.rate for row in alarm_rows])
        ends = [rate - [row.ci_low for row in alarm_rows], [row.ci_high for row in alarm_rows] - rate]
        axes.bar(x, rate, 0.92 * width, color=color, label=label)
        axes.errorbar(x, rate, np.maximum(ends, 0.0), fmt="none", ecolor="black", elinewidth=0.5)
    axes.axhline(level, color="black", lw=0.6, ls=":", label=f"level of the rule, {as_percent(level)}")
    axes.set_xticks(range(len(shown)), [_bar_label(by_alarm, subject, kind) for subject, kind in shown])
    axes.tick_params(axis="x", length=0)
    axes.set_xlim(-0.5, len(shown) - 0.5)
    axes.set_ylim(0.0, 1.02)
    axes.set_ylabel("share of recordings with an alarm")
    volunteers = "; by name: each virtual volunteer recorded anew" if len(shown) > WELL_SPECIFIED else ""
    axes.set_xlabel(f"well-specified recordings of all: own noise, acquired{volunteers}")
    axes.legend(ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0), columnspacing=1.2, handlelength=1.4)


def _columns(verdicts: Mapping[str, Verdict]) -> list[str]:
    """Return the names of all tests, those with a null distribution first."""
    names = dict.fromkeys(test.name for verdict in verdicts.values() for test in verdict.tests)
    return [*(name for name in TEST_NAMES if name in names), *(n for n in names if n not in TEST_NAMES)]


def _recordings(rows: Sequence[AlarmRow]) -> list[tuple[str, str]]:
    """Return which recordings have bars: the well-specified of the cohort, then each volunteer."""
    volunteers = dict.fromkeys(row.subject for row in rows if row.recordings == VOLUNTEER)
    return [(COHORT, OWN), (COHORT, ACQUIRED), *((subject, VOLUNTEER) for subject in volunteers)]


def _bar_label(rows: Mapping[tuple[str, str, str], AlarmRow], subject: str, kind: str) -> str:
    words = {OWN: "own noise", ACQUIRED: "acquired"}
    return f"{words.get(kind, subject)}\nn = {rows[(subject, kind, Status.CONTRADICTED)].n}"


def _p_text(p: float) -> str:
    return "<.001" if p < 0.001 else f"{p:.3f}".lstrip("0") if p < 0.1 else f"{p:.2f}".lstrip("0")


def _statistic_text(test: VerdictTest) -> str:
    """Return a count as a count, and a z with a true minus."""
    if test.threshold == 0.0:
        return f"{test.statistic:.0f}"
    return f"{test.statistic:.1f}".replace("-", "−")
