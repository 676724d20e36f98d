"""The misspecification tests: p-values and verdict of every subject, and the rate of false alarms."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator

from swesbi.artefacts.typed import BySubject
from swesbi.checks.calibration.alarms import ALARMS, AlarmTable
from swesbi.checks.calibration.settings import JudgementSettings
from swesbi.population.recordings import MODEL_NOISE, SAMPLE_BY_SAMPLE
from swesbi.report.figures.forest import Panel, Series, finish_panel, intervals, name_rows
from swesbi.report.figures.style import (
    OBSERVED,
    PRIOR,
    SERIES,
    STATUS_COLORS,
    TEXT_WIDTH_IN,
    Drawing,
    new_figure,
    shared_legend,
    style,
    titled,
)
from swesbi.report.numbers import as_percent, count
from swesbi.verdict.summary import RECORDINGS, label_of_test
from swesbi.verdict.verdict import Verdict

WIDTH_IN: Final = 1.45 * TEXT_WIDTH_IN
ROW_IN: Final = 0.26
LEAST_IN: Final = 1.4
FRAME_IN: Final = 1.4
LEAST_P: Final = 1e-4
"""Where smaller p-values are drawn, below all that null recordings can tell."""
RATE: Final = ("ci_low", "rate", "ci_high")
P_VALUE: Final = ("p_value", "p_value", "p_value")


def misspecification_figure(
    table: AlarmTable,
    verdicts: BySubject[Verdict],
    *,
    cohort_title: str,
    doubtful_level: float,
    judgement: JudgementSettings,
) -> Drawing:
    """Draw every subject's p-values and verdict, and beside them how often the tests raise an alarm.

    Args:
        table: ``alarms.csv``.
        verdicts: Verdict of each subject, in the order of the figure.
        cohort_title: What the subjects are ("virtual volunteers").
        doubtful_level: False-alarm rate that the rule is to keep.
        judgement: The confidence of the intervals on rates.

    Raises:
        ValueError: There is no subject.
    """
    subjects = dict(verdicts)
    if not subjects:
        raise ValueError("no subject to draw: the cohort is empty")
    with style():
        figure = new_figure(WIDTH_IN, FRAME_IN + max(LEAST_IN, ROW_IN * len(subjects)))
        tests, rates = figure.subplots(1, 2)
        _draw_p_values(tests, subjects)
        _draw_rates(rates, table, doubtful_level, judgement.confidence)
        figure.suptitle(titled("Misspecification tests", cohort_title), fontsize=7.5)
        shared_legend(figure, [tests, rates], entries_a_row=4)
    return figure


def _draw_p_values(axes: Axes, verdicts: Mapping[str, Verdict]) -> None:
    """Draw the p-values of each subject, filled where they are flagged, and name its verdict."""
    rows = pd.DataFrame(
        [
            (subject, test.name, f"{test.name} {test.flagged}", max(test.p_value, LEAST_P))
            for subject, verdict in verdicts.items()
            for test in verdict.tests
            if test.p_value is not None
        ],
        columns=["row", "test", "series", "p_value"],
    )
    look = {}
    for test, color in zip(dict.fromkeys(rows["test"]), SERIES[2:], strict=False):
        words = label_of_test(test)
        look[f"{test} False"] = Series(color, words, filled=False, lane=test, size=3.4)
        look[f"{test} True"] = Series(color, f"{words}, flagged", lane=test, size=4.4)
    intervals(axes, rows, look, order=list(verdicts), of=P_VALUE)
    name_rows(axes, [f"{subject}: {verdict.status}" for subject, verdict in verdicts.items()])
    for ticked, verdict in zip(axes.get_yticklabels(), verdicts.values(), strict=True):
        ticked.set_color(STATUS_COLORS.get(verdict.status, PRIOR))
    axes.set_xlim(0.5 * LEAST_P, 2.0)
    label = "p-value among well-specified recordings"
    finish_panel(axes, Panel("(a) tests of each subject", label, "log"))
    axes.xaxis.set_major_locator(LogLocator())


def _draw_rates(axes: Axes, table: pd.DataFrame, level: float, confidence: float) -> None:
    """Draw the share of well-specified recordings on which each test, and the verdict, raise an alarm."""
    numbers = table.drop_duplicates("recordings").set_index("recordings")["n"]
    look = {
        kind: Series(OBSERVED, f"{RECORDINGS[kind]} (n = {count(numbers[kind])})", filled=filled)
        for kind, filled in ((MODEL_NOISE, True), (SAMPLE_BY_SAMPLE, False))
    }
    rows = table.assign(row=table["alarm"], series=table["recordings"])
    intervals(axes, rows, look, order=ALARMS, of=RATE)
    name_rows(axes, [label_of_test(alarm) for alarm in ALARMS])
    axes.set_xlim(left=-0.02 * axes.get_xlim()[1])
    label = f"recordings ({as_percent(confidence)} Clopper-Pearson intervals)"
    title = f"(b) false alarms; dashed: {as_percent(level)} asked for"
    finish_panel(axes, Panel(title, label, "percent", level))
