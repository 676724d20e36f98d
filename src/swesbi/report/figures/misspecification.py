"""The misspecification tests: p-values and verdict of every subject, and the rate of false alarms."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator

from swesbi.artefacts.typed import BySubject
from swesbi.checks.calibration.table import ALARMS, AlarmTable
from swesbi.checks.settings import JudgementSettings
from swesbi.population.recordings import MODEL_NOISE, SAMPLE_BY_SAMPLE
from swesbi.report.figures.forest import Panel, Series, finish_panel, intervals, name_rows
from swesbi.report.figures.style import (
    OBSERVED,
    PRIOR,
    SERIES,
    STATUS_COLORS,
    WIDE_IN,
    Drawing,
    drawing,
    plain,
    shared_legend,
    titled,
)
from swesbi.report.numbers import as_percent, count
from swesbi.verdict.summary import RECORDINGS, label_of_test
from swesbi.verdict.verdict import Verdict

LEAST_P: Final = 1e-4
"""Where smaller p-values are drawn, below all that null recordings can tell."""


def misspecification_figure(
    table: AlarmTable,
    verdicts: BySubject[Verdict],
    *,
    cohort_title: str,
    doubtful_level: float,
    judgement: JudgementSettings,
) -> Drawing:
    """Draw every subject's p-values and verdict, and beside them how often the tests raise an alarm.

    ``doubtful_level`` is the false-alarm rate that the rule is to keep.
    """
    subjects = dict(verdicts)
    height_in = 1.4 + max(1.4, 0.26 * len(subjects))
    with drawing(WIDE_IN, height_in, titled("Misspecification tests", cohort_title)) as figure:
        tests, rates = figure.subplots(1, 2)
        _draw_p_values(tests, subjects)
        _draw_rates(rates, table, doubtful_level, judgement.confidence)
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
    intervals(axes, rows, look, order=list(verdicts), of=("p_value",) * 3)
    name_rows(axes, [plain(f"{subject}: {verdict.status}") for subject, verdict in verdicts.items()])
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
    intervals(axes, rows, look, order=ALARMS, of=("ci_low", "rate", "ci_high"))
    name_rows(axes, [label_of_test(alarm) for alarm in ALARMS])
    axes.set_xlim(left=-0.02 * axes.get_xlim()[1])
    label = f"recordings ({as_percent(confidence)} Clopper-Pearson intervals)"
    title = f"(b) false alarms; dashed: {as_percent(level)} asked for"
    finish_panel(axes, Panel(title, label, "percent", level))
