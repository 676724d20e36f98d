from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from cohort_case import REASON, STRATA, TITLE, answer, context, strata, table
from exact_shown import PRIOR
from figure_text import assert_text_apart, text_boxes
from study_copy import StudyCopy

from swesbi.artefacts import ArtefactError
from swesbi.checks.pressures import COLUMNS, RESISTANCE
from swesbi.heart.physiology import CAPACITANCE, TIME_CONSTANT, VOLUME_FACTOR
from swesbi.parameters import PEAK_ACTIVE, PHI_NAMES
from swesbi.posterior.result import ExactPosterior
from swesbi.report.figures.calibration import draw_strata
from swesbi.report.figures.cohort import OUTSIDE, Overview, counted_reasons, draw_cohort, draw_pressures
from swesbi.report.page.sections import make_population_section
from swesbi.report.tables.population import PopulationSection, cohort_table, pressures_table, strata_table
from swesbi.verdict import summary

RANGES = {"hr_bpm": [40, 130], "lvedv_ml": [35, 200], "ivsd_cm": [0.4, 1.4], "relative_thickness": [0.1, 0.7]}
SETTINGS = {
    "base": "calibrated",
    "simulations": {"contexts": 5000, "draws_per_context": 40},
    "population": {"declared_range": RANGES},
}
RATIOS = {RESISTANCE: 0.8, TIME_CONSTANT: 0.9, VOLUME_FACTOR: np.nan}


def shown(subjects: int, refused: int, pressures: pd.DataFrame | None = None) -> PopulationSection:
    return PopulationSection("amortised", SETTINGS, 0.9, table(subjects, refused), strata(), pressures)


def made(subjects: int = 3) -> pd.DataFrame:
    """The table of so many subjects; widths of R_d are 0.8, 0.85, 0.9 of those without, and so on."""
    rows = []
    for number in range(subjects):
        for name in (PEAK_ACTIVE.name, *PHI_NAMES, RESISTANCE, TIME_CONSTANT, VOLUME_FACTOR, CAPACITANCE):
            ratio = RATIOS.get(name, 1.0) + 0.05 * number
            known, unit = np.nan if name == VOLUME_FACTOR else 1.0, 1.4e8 if name == RESISTANCE else 1.0
            limits = (0.95 * known, 0.9 * known, 1.1 * known, 1.02, 0.93, 1.12)
            values = (*(unit * limit for limit in limits), ratio, 0.1 * known)
            how = (126.0, 83.0, "importance", 0.17, 0.4, number != 2)
            rows.append(("amortised", f"S{number}", name, *values, *how))
    return pd.DataFrame(rows, columns=list(COLUMNS))


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
    assert "Exact posteriors" not in make_population_section(shown(3, 3), {}, TITLE).facts


def test_a_large_cohort_is_counted() -> None:
    rows = cohort_table(shown(60, 6), TITLE).rows
    assert [row.cells[2] for row in rows] == ["18", "0", "18", "18", "6"]
    assert rows[3].cells[1] == "mass at a bound (18), χ² (18)"
    assert rows[4].cells[3:] == ("10.0", "–")


def test_widths_and_shifts_with_pressures_stand_by_quantity() -> None:
    by_name = {row.cells[0]: row.cells[1:] for row in pressures_table(made(), TITLE).rows}
    assert list(by_name) == [
        "k_0", "k_ATP", "k_SR", "passive stiffness a", "peak active stiffness", "R_d", "R_d C_s", "C_s", "f_V"
    ]  # fmt: skip
    assert by_name["R_d"] == ("0.85 (0.80 to 0.90)", "0.10 (0.10 to 0.10)")
    assert by_name["f_V"] == ("–", "–")
    with_them, without = (make_population_section(shown(4, 1, one), {}, TITLE) for one in (made(), None))
    assert with_them.tables.keys() - without.tables.keys() == {"pressures", "pressures_subjects"}
    assert with_them.facts["With cuff pressures"].startswith(
        "R_d: intervals 0.85 times as wide (median); R_d"
    )
    assert "With cuff pressures" not in without.facts


@pytest.mark.parametrize("subjects", [1, 8])
def test_the_figure_of_pressures_has_its_texts_apart(subjects: int) -> None:
    figure = draw_pressures(made(subjects), experiment="amortised", cohort_title=TITLE)
    assert_text_apart(figure)
    assert len(figure.axes) == 8
    assert figure.axes[5].get_xlabel() == f"width {0.8 + 0.025 * (subjects - 1):.2f} of that without"
    assert not figure.axes[7].get_xlabel()  # the stressed volume is not free without
    assert figure.axes[5].get_title("left") == "resistance $R_d$ (mmHg s/mL)"
    without = figure.axes[5].lines[0].get_xdata()
    np.testing.assert_allclose(without, 0.95 * 1.4e8 / 133.322387415e6)


def overview(subjects: int, refused: int, *, truth: bool) -> Overview:
    shown = table(subjects, refused)
    known = dict.fromkeys(shown["subject"], np.array([42.0, 5.0, 30.0])) if truth else {}
    return Overview(shown, known, PRIOR, 0.9)


def test_the_table_reads_back_with_empty_answers(tmp_path: Path) -> None:
    path = tmp_path / "cohort.csv"
    table(4, 2).to_csv(path, index=False)
    assert summary.COHORT.read(path)["reason"].tolist() == ["", "χ²", REASON, REASON]
    path.write_text("subject,status\nA,not contradicted\n")
    with pytest.raises(ArtefactError, match="lacks the columns reason, duration_ms_median"):
        summary.COHORT.read(path)
    with pytest.raises(ArtefactError, match="S001: neither a posterior nor a reason"):
        summary.cohort_table([context(0), context(1)], {"S000": answer(0)}, {})


def test_reasons_are_counted_by_subject_the_commonest_first() -> None:
    assert counted_reasons(table(8, 2)) == {"χ²": 4, OUTSIDE: 2, "mass at a bound": 2}


@pytest.mark.parametrize(("subjects", "refused", "truth"), [(6, 1, False), (60, 3, True), (2, 2, False)])
def test_the_overview_is_readable_and_of_one_size_whatever_the_cohort(
    subjects: int, refused: int, truth: bool
) -> None:
    figure = draw_cohort(overview(subjects, refused, truth=truth), TITLE, "amortised")
    assert figure.get_size_inches().tolist() == [7.2, 7.0]
    assert_text_apart(figure)
    texts = [text for text, _ in text_boxes(figure)]
    assert any(TITLE in text for text in texts)
    assert f"refused ({refused})" in texts
    assert ("S000" in texts) == (subjects <= 24 and refused < subjects)


def test_a_truth_widens_the_axes_to_hold_it() -> None:
    far = replace(overview(6, 0, truth=False), truth={"S000": np.array([900.0, 5.0, 30.0])})
    assert draw_cohort(far, TITLE, "amortised").axes[0].get_ylim()[1] > 900.0


def test_strata_are_drawn_with_their_numbers_and_no_text_on_another() -> None:
    figure = draw_strata(strata(), interval=0.9, experiment="amortised")
    assert_text_apart(figure)
    assert "female (400; 60 %)" in [text for text, _ in text_boxes(figure)]
    with pytest.raises(ValueError, match="no coverage of 80 % intervals"):
        draw_strata(strata(), interval=0.8, experiment="amortised")


def test_the_table_of_a_study_has_the_medians_and_limits_of_its_draws(finished: StudyCopy) -> None:
    folder = finished.results / "amortised"
    shown = summary.COHORT.read(folder / "cohort.csv").set_index("subject")
    assert list(shown.index) == ["A", "F", "G"]
    for subject in shown.index:
        phi = ExactPosterior.read(folder / "subjects" / subject / "posterior.h5").phi
        for j, name in enumerate(PHI_NAMES):
            limits = shown.loc[subject, [f"{name}_{end}" for end in ("low", "median", "high")]]
            np.testing.assert_allclose(
                limits.to_numpy(dtype=float), np.quantile(phi[:, j], [0.05, 0.5, 0.95]), rtol=1e-6
            )
