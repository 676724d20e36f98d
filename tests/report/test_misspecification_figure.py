"""The figure of the misspecification tests: every subject, test and verdict, and no text on another."""

from __future__ import annotations

import pytest
from figure_text import assert_text_apart
from matplotlib.figure import Figure

from swesbi.checks.calibration.alarms import ALARMS, AlarmRow
from swesbi.report.figures.misspecification import draw_misspecification
from swesbi.verdict.misfits import TESTS
from swesbi.verdict.verdict import STATUSES, Status, Verdict, VerdictTest

ROWS = [
    AlarmRow(kind, alarm, 0.05, 0.03, 0.08, 600)
    for kind in ("model_noise", "sample_by_sample")
    for alarm in ALARMS
]


def verdict(status: Status, p: float) -> Verdict:
    tests = tuple(VerdictTest(name, 2.0, p, 0.01, p <= 0.01, "") for name in TESTS)
    volumes = tuple(
        VerdictTest(name, -12.4, None, 3.0, True, "")
        for name in ("end_diastolic_volume", "end_systolic_volume", "ejection_time")
    )
    contexts = (
        VerdictTest("context_leave_one_out", 1.0, 0.9, 0.01, False, ""),
        VerdictTest("context_ranges", 0.0, None, 0.0, False, ""),
    )
    return Verdict(1.0, "maximum_kpa", 10, 10, {}, status, "", (), (*tests, *volumes, *contexts))


def drawn(subjects: tuple[str, ...]) -> Figure:
    verdicts = {name: verdict(STATUSES[i % len(STATUSES)], 10.0 ** (-i)) for i, name in enumerate(subjects)}
    return draw_misspecification(verdicts, ROWS, 0.05, "virtual volunteers")


@pytest.mark.parametrize("subjects", [("A",), tuple("ABCDEF")])
def test_no_text_overlaps_another_or_leaves_the_figure(subjects: tuple[str, ...]) -> None:
    assert_text_apart(drawn(subjects))


def test_flagged_tests_are_framed() -> None:
    cells = drawn(("A", "B", "C")).axes[0].patches
    framed = [cell for cell in cells if cell.get_linewidth() > 1.0]
    assert len(framed) == 3 * 3 + len(TESTS)  # volumes and ejection of all, and every p-value of C


def test_a_cohort_without_subjects_is_refused() -> None:
    with pytest.raises(ValueError, match="empty"):
        draw_misspecification({}, ROWS, 0.05, "virtual volunteers")
