"""The page's section on experiments over a population."""

from __future__ import annotations

from cohort_case import REASON, STRATA, TITLE, strata, table

from swesbi.report.page.sections import make_population_section
from swesbi.report.tables.population import PopulationSection, cohort_table, strata_table

SETTINGS = {
    "base": "calibrated",
    "interval": 0.9,
    "simulations": {"contexts": 5000, "draws_per_context": 40},
    "population": {
        "declared_range": {
            "hr_bpm": [40.0, 130.0],
            "lvedv_ml": [35.0, 200.0],
            "ivsd_cm": [0.4, 1.4],
            "relative_thickness": [0.15, 0.7],
        }
    },
}


def shown(subjects: int, refused: int) -> PopulationSection:
    return PopulationSection("amortised", SETTINGS, 0.9, table(subjects, refused), strata())


def test_coverage_stands_by_stratum_and_answer_at_the_level_of_the_intervals() -> None:
    rows = strata_table(shown(3, 0)).rows
    assert len(rows) == 2 * len(STRATA)
    assert rows[0].cells == ("all", "network alone", *["90.0 (87.0 to 92.0)"] * 3, "400", "60")
    assert [row.mark for row in rows[:3]] == ["summary", "summary", ""]


def test_a_small_cohort_has_a_row_a_subject_and_the_refused_their_reason() -> None:
    rows = cohort_table(shown(4, 1), TITLE).rows
    assert [row.cells[1] for row in rows] == ["not contradicted", "doubtful", "contradicted", "refused"]
    assert [row.mark for row in rows] == ["", "doubtful", "muted", "muted"]
    assert rows[0].cells[3] == "40.0 (32.0 to 52.0)"
    assert rows[-1].cells[2:] == (REASON, *["–"] * 7)


def test_a_large_cohort_is_counted() -> None:
    rows = cohort_table(shown(60, 6), TITLE).rows
    assert [row.cells[2] for row in rows] == ["18", "0", "18", "18", "6"]
    assert rows[3].cells[1] == "mass at a bound (18), χ² (18)"
    assert rows[4].cells[3:] == ("10.0", "–")


def test_nobody_answered_is_no_error() -> None:
    assert "Exact posteriors" not in make_population_section(shown(3, 3), {}, TITLE).facts
