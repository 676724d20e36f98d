"""What cuff pressures add, on the page and in the documentation: what a made-up table says is written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from cohort_case import TITLE, strata, table
from figure_text import assert_text_apart
from test_report_population import SETTINGS

from swesbi.artefacts import ArtefactError
from swesbi.artefacts.csv import write_csv
from swesbi.checks.pressures import COLUMNS, PRESSURES, RESISTANCE
from swesbi.heart.physiology import CAPACITANCE, TIME_CONSTANT, VOLUME_FACTOR
from swesbi.parameters import PEAK_ACTIVE, PHI_NAMES
from swesbi.report.figures.pressures import draw_pressures
from swesbi.report.page.sections import make_population_section
from swesbi.report.tables.population import PopulationSection
from swesbi.report.tables.pressures import pressures_table

RATIOS = {RESISTANCE: 0.8, TIME_CONSTANT: 0.9, VOLUME_FACTOR: np.nan}


def made(subjects: int = 3, experiment: str = "amortised") -> pd.DataFrame:
    """The table of so many subjects; widths of R_d are 0.8, 0.85, 0.9 of those without, and so on."""
    rows = []
    for number in range(subjects):
        for name in (PEAK_ACTIVE.name, *PHI_NAMES, RESISTANCE, TIME_CONSTANT, VOLUME_FACTOR, CAPACITANCE):
            ratio = RATIOS.get(name, 1.0) + 0.05 * number
            known, unit = np.nan if name == VOLUME_FACTOR else 1.0, 1.4e8 if name == RESISTANCE else 1.0
            limits = (0.95 * known, 0.9 * known, 1.1 * known, 1.02, 0.93, 1.12)
            values = (*(unit * limit for limit in limits), ratio, 0.1 * known)
            how = (126.0, 83.0, "importance", 0.17, 0.4, number != 2)
            rows.append((experiment, f"S{number}", name, *values, *how))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def shown(pressures: pd.DataFrame | None) -> PopulationSection:
    return PopulationSection("amortised", SETTINGS, 0.9, table(4, 1), strata(), pressures)


def test_widths_and_shifts_stand_by_quantity() -> None:
    found = pressures_table(made(), TITLE)
    assert found.caption == f"What pressures add: 3 {TITLE}."
    by_name = {row.cells[0]: row.cells[1:] for row in found.rows}
    assert list(by_name) == [
        "k_0", "k_ATP", "k_SR", "passive stiffness a", "peak active stiffness", "R_d", "R_d C_s", "C_s", "f_V"
    ]  # fmt: skip
    assert by_name["R_d"] == ("0.85 (0.80 to 0.90)", "0.10 (0.10 to 0.10)")
    assert by_name["f_V"] == ("–", "–")


def test_the_section_has_them_where_there_are_any() -> None:
    with_them, without = (make_population_section(shown(one), {}, TITLE) for one in (made(), None))
    assert {"pressures", "pressures_subjects"} <= set(with_them.tables)
    assert with_them.facts["With cuff pressures"] == (
        "R_d: intervals 0.85 times as wide (median); R_d C_s: intervals 0.95 times as wide (median)"
    )
    assert "pressures" not in without.tables
    assert "With cuff pressures" not in without.facts


def test_a_table_that_lacks_a_column_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "pressures.csv"
    write_csv(path, made().drop(columns="shift_in_widths"))
    with pytest.raises(ArtefactError, match="pressures.csv: lacks the columns shift_in_widths"):
        PRESSURES.read(path)


@pytest.mark.parametrize("subjects", [1, 8])
def test_the_figure_has_its_texts_apart(subjects: int) -> None:
    figure = draw_pressures(made(subjects), experiment="amortised", cohort_title=TITLE)
    assert_text_apart(figure)
    assert len(figure.axes) == 8
    assert figure.axes[5].get_xlabel() == f"width {0.8 + 0.025 * (subjects - 1):.2f} of that without"
    assert not figure.axes[7].get_xlabel()  # the stressed volume is not free without
    assert figure.axes[5].get_title("left") == "resistance $R_d$ (mmHg s/mL)"
    without = figure.axes[5].lines[0].get_xdata()
    np.testing.assert_allclose(without, 0.95 * 1.4e8 / 133.322387415e6)
