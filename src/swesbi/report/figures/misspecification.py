"""The misspecification tests: p-values and verdict of every subject, and the rate of false alarms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from swesbi.artefacts.typed import BySubject
from swesbi.checks.calibration.alarms import DOUBTFUL_OR_WORSE, AlarmRow, AlarmTable
from swesbi.population.recordings import MODEL_NOISE, SAMPLE_BY_SAMPLE
from swesbi.report.figures.style import (
    CMAES,
    POSTERIOR,
    PRIOR,
    TEXT_WIDTH_IN,
    TRUTH,
    Drawing,
    new_figure,
    style,
    titled,
)
from swesbi.report.numbers import as_percent
from swesbi.report.results import records
from swesbi.verdict.misfits import TESTS
from swesbi.verdict.verdict import Status, Verdict, VerdictTest

ROW_IN: Final = 0.26
RATES_IN: Final = 2.1
MARGINS_IN: Final = 1.75
SMALLEST_SHOWN: Final = 1e-4
STATUS_COLORS: Final = {
    Status.NOT_CONTRADICTED: TRUTH,
    Status.UNINFORMATIVE: PRIOR,
    Status.DOUBTFUL: "#E69F00",
    Status.CONTRADICTED: CMAES,
}
BARS: Final = {
    "residuals": ("#CC79A7", "residuals"),
    "boundary_mass": (POSTERIOR, "mass at the bounds"),
    DOUBTFUL_OR_WORSE: (STATUS_COLORS[Status.DOUBTFUL], "verdict: doubtful or contradicted"),
    Status.CONTRADICTED: (STATUS_COLORS[Status.CONTRADICTED], "verdict: contradicted"),
}
"""Color and label of the bars of each alarm."""
RECORDINGS: Final = {MODEL_NOISE: "own noise", SAMPLE_BY_SAMPLE: "sample_by_sample"}
LABELS: Final = {
    "residuals": "residuals",
    "boundary_mass": "boundary mass",
    "context_leave_one_out": "context, others",
    "context_ranges": "values out of range",
    "end_diastolic_volume": "LVEDV (z)",
    "end_systolic_volume": "LVESV (z)",
    "ejection_time": "LVET (z)",
}


def misspecification_figure(
    table: AlarmTable, verdicts: BySubject[Verdict], *, cohort_title: str, doubtful_level: float
) -> Drawing:
    """Draw every subject's p-values and verdict, and below them how often the tests raise an alarm."""
    rows = [AlarmRow(**{str(name): value for name, value in row.items()}) for row in records(table)]
    return draw_misspecification(dict(verdicts), rows, doubtful_level, cohort_title)


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
    """Draw the share of well-specified recordings on which each test, and both together, raise an alarm."""
    by_alarm = {(row.recordings, row.alarm): row for row in rows}
    width = 0.8 / len(BARS)
    for which, (alarm, (color, label)) in enumerate(BARS.items()):
        of_kind = [by_alarm[(kind, alarm)] for kind in RECORDINGS]
        x = np.arange(len(of_kind)) + (which - 0.5 * (len(BARS) - 1)) * width
        rate = np.array([row.rate for row in of_kind])
        ends = [rate - [row.ci_low for row in of_kind], [row.ci_high for row in of_kind] - rate]
        axes.bar(x, rate, 0.92 * width, color=color, label=label)
        axes.errorbar(x, rate, np.maximum(ends, 0.0), fmt="none", ecolor="black", elinewidth=0.5)
    axes.axhline(level, color="black", lw=0.6, ls=":", label=f"level of the rule, {as_percent(level)}")
    counts = [by_alarm[(kind, DOUBTFUL_OR_WORSE)].n for kind in RECORDINGS]
    names = [f"{words}\nn = {n}" for words, n in zip(RECORDINGS.values(), counts, strict=True)]
    axes.set_xticks(range(len(names)), names)
    axes.tick_params(axis="x", length=0)
    axes.set_ylim(0.0, None)
    axes.set_ylabel("share of recordings\nwith an alarm")
    axes.set_xlabel("recordings of known parameters, of all subjects together")
    axes.legend(ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0), columnspacing=1.2, handlelength=1.4)


def _columns(verdicts: Mapping[str, Verdict]) -> list[str]:
    """Return the names of all tests, those with a null distribution first."""
    names = dict.fromkeys(test.name for verdict in verdicts.values() for test in verdict.tests)
    return [*(name for name in TESTS if name in names), *(n for n in names if n not in TESTS)]


def _p_text(p: float) -> str:
    return "<.001" if p < 0.001 else f"{p:.3f}".lstrip("0") if p < 0.1 else f"{p:.2f}".lstrip("0")


def _statistic_text(test: VerdictTest) -> str:
    """Return a count as a count, and a z with a true minus."""
    if test.threshold == 0.0:
        return f"{test.statistic:.0f}"
    return f"{test.statistic:.1f}".replace("-", "−")
