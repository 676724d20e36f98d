"""The figure of the misspecification tests: every subject, test and verdict, and no text on another."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from calibration_case import JUDGEMENT
from figure_text import assert_text_apart, text_boxes
from matplotlib.figure import Figure

from swesbi.checks.calibration.alarms import ALARMS, COLUMNS
from swesbi.report.figures.misspecification import misspecification_figure
from swesbi.verdict.misfits import TESTS
from swesbi.verdict.verdict import STATUSES, Status, Verdict, VerdictTest

RATES = pd.DataFrame(
    [
        (kind, alarm, 0.05, 0.03, 0.08, 600)
        for kind in ("model_noise", "sample_by_sample")
        for alarm in ALARMS
    ],
    columns=list(COLUMNS),
)


def verdict(status: Status, p: float) -> Verdict:
    tests = tuple(VerdictTest(name, 2.0, p, 0.01, p <= 0.01, "") for name in TESTS)
    volume = VerdictTest("end_diastolic_volume", -12.4, None, 3.0, True, "")
    context = VerdictTest("context_leave_one_out", 1.0, 0.9, 0.01, False, "")
    return Verdict(1.0, "maximum_kpa", 10, 10, {}, status, "", (), (*tests, volume, context))


def drawn(subjects: tuple[str, ...]) -> Figure:
    verdicts = {name: verdict(STATUSES[i % len(STATUSES)], 10.0 ** (-i)) for i, name in enumerate(subjects)}
    return misspecification_figure(
        RATES, verdicts, cohort_title="virtual volunteers", doubtful_level=0.05, judgement=JUDGEMENT
    )


@pytest.mark.parametrize("subjects", [("A",), tuple("ABCDEF")])
def test_every_verdict_is_named_and_no_text_overlaps_another(subjects: tuple[str, ...]) -> None:
    figure = drawn(subjects)
    assert_text_apart(figure)
    texts = [text for text, _ in text_boxes(figure)]
    assert {f"{name}: {STATUSES[i % len(STATUSES)]}" for i, name in enumerate(subjects)} <= set(texts)


def test_flagged_p_values_are_filled_and_none_is_off_the_axis() -> None:
    axes = drawn(tuple("ABCDEF")).axes[0]
    marks = [line for line in axes.get_lines() if line.get_marker() == "o" and len(line.get_xdata())]
    filled = [line for line in marks if line.get_markerfacecolor() != "white"]
    assert sum(len(line.get_xdata()) for line in filled) == 4 * len(TESTS)  # of C to F
    assert sum(len(line.get_xdata()) for line in marks) == 6 * (len(TESTS) + 1)
    shown = np.concatenate([line.get_xdata() for line in marks])
    assert shown.min() == pytest.approx(1e-4) and axes.get_xlim()[0] < 1e-4


def test_rates_are_drawn_with_the_ends_of_their_intervals() -> None:
    rates = drawn(("A",)).axes[1]
    lines = np.array([line[:, 0] for part in rates.collections for line in part.get_segments()])
    np.testing.assert_allclose(lines, [[0.03, 0.08]] * (2 * len(ALARMS)))


def test_a_cohort_without_subjects_is_refused() -> None:
    with pytest.raises(ValueError, match="empty"):
        drawn(())
