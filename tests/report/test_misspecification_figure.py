"""The figure of the misspecification tests: every subject, test and verdict, and no text on another."""

from __future__ import annotations

import pytest
from figure_text import assert_text_apart
from matplotlib.figure import Figure

from swesbi.report.figures.misspecification import draw_misspecification
from swesbi.verdict.power import COHORT, STRAINED_OR_WORSE, AlarmRow
from swesbi.verdict.statistics import GROUPS, TEST_NAMES
from swesbi.verdict.verdict import STATUSES, Status, Verdict, VerdictTest

ALARMS = (*(f"group: {group}" for group in GROUPS), STRAINED_OR_WORSE, Status.CONTRADICTED)


def verdict(status: Status, p: float) -> Verdict:
    tests = tuple(VerdictTest(name, 2.0, p, 0.01, p <= 0.01, "") for name in TEST_NAMES)
    volumes = tuple(
        VerdictTest(name, -12.4, None, 3.0, True, "")
        for name in ("end_diastolic_volume", "end_systolic_volume", "ejection_time")
    )
    contexts = (
        VerdictTest("context_leave_one_out", 1.0, 0.9, 0.01, False, ""),
        VerdictTest("context_ranges", 0.0, None, 0.0, False, ""),
    )
    return Verdict(1.0, "maximum_kpa", 10, 10, {}, status, "", (), (*tests, *volumes, *contexts))


def rows(subjects: tuple[str, ...]) -> list[AlarmRow]:
    kinds = [(COHORT, "own"), (COHORT, "acquired"), *((subject, "volunteer") for subject in subjects)]
    return [
        AlarmRow(subject, kind, alarm, 0.05, 0.03, 0.08, 600, 0, 0.8)
        for subject, kind in kinds
        for alarm in ALARMS
    ]


def drawn(subjects: tuple[str, ...], with_volunteers: bool = True) -> Figure:
    verdicts = {name: verdict(STATUSES[i % len(STATUSES)], 10.0 ** (-i)) for i, name in enumerate(subjects)}
    return draw_misspecification(
        verdicts, rows(subjects if with_volunteers else ()), 0.05, "virtual volunteers"
    )


@pytest.mark.parametrize("subjects", [("A",), tuple("ABCDEF")])
@pytest.mark.parametrize("with_volunteers", [True, False])
def test_no_text_overlaps_another_or_leaves_the_figure(
    subjects: tuple[str, ...], with_volunteers: bool
) -> None:
    assert_text_apart(drawn(subjects, with_volunteers))


def test_flagged_tests_are_framed() -> None:
    cells = drawn(("A", "B", "C")).axes[0].patches
    framed = [cell for cell in cells if cell.get_linewidth() > 1.0]
    assert len(framed) == 3 * 3 + len(TEST_NAMES)  # volumes and ejection of all, and every p-value of C


def test_a_cohort_without_subjects_is_refused() -> None:
    with pytest.raises(ValueError, match="empty"):
        draw_misspecification({}, rows(()), 0.05, "virtual volunteers")
