"""Cuff pressures and ejection time: optional columns, each cell of which may be empty."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from cohorts import HEADER, ROWS, write_cohort
from pydantic import ValidationError
from rules import settings_of
from study_copy import ROOT

from swesbi.config.read import overlay, read_merged
from swesbi.config.study import Study, load_study
from swesbi.recording.cohort.clinical import ClinicalMeasures, ClinicalRow
from swesbi.recording.cohort.subjects import read_subject_table
from swesbi.recording.problems import RecordingError
from swesbi.study.answerer import answer_settings

FIRST, SECOND = ROWS.values()
ALL = "sbp_mmhg,dbp_mmhg,lvet_ms"


def written(folder: Path, header: str, *cells: str) -> Path:
    """``subjects.csv`` with further columns, whose cells are given for the first rows."""
    path = folder / "subjects.csv"
    rows = (f"{row},{own}" for row, own in zip(ROWS.values(), cells, strict=False))
    path.write_text("\n".join([f"{HEADER},{header}", *rows]) + "\n", encoding="utf-8")
    return path


def measured(path: Path) -> list[ClinicalMeasures]:
    return [row.to_measures() for row in read_subject_table(path).clinical.values()]


def test_a_cohort_without_the_columns_has_nothing_measured(tmp_path: Path) -> None:
    path = tmp_path / "subjects.csv"
    path.write_text(f"{HEADER}\n{FIRST}\n", encoding="utf-8")
    (row,) = read_subject_table(path).clinical.values()
    assert row.to_plain() == {"dbp_mmhg": None, "lvet_ms": None, "sbp_mmhg": None}
    assert not row.to_measures().has_pressures and not row.to_measures().has_ejection_time


def test_what_is_there_is_read_and_an_empty_cell_was_not_measured(tmp_path: Path) -> None:
    first, second = measured(written(tmp_path, ALL, "118,74,", ",NaN,295.5"))
    assert (first.sbp_mmhg, first.dbp_mmhg) == (118.0, 74.0) and math.isnan(first.lvet_ms)
    assert second.lvet_ms == 295.5 and not second.has_pressures and second.has_ejection_time


@pytest.mark.parametrize(("header", "cells"), [("lvet_ms", "300"), ("dbp_mmhg,sbp_mmhg", "70,110")])
def test_any_of_the_columns_may_be_left_out_and_their_order_is_free(
    tmp_path: Path, header: str, cells: str
) -> None:
    (only,) = measured(written(tmp_path, header, cells))
    assert only.has_pressures == ("sbp" in header)
    assert only.has_ejection_time == ("lvet" in header)


def test_a_spreadsheet_with_semicolons_and_decimal_commas(tmp_path: Path) -> None:
    path = tmp_path / "subjects.csv"
    path.write_text(
        f"{HEADER},{ALL}\n".replace(",", ";") + "x;F;25;1,7;60;90;34;0,8;118,5;74,2;\n", encoding="utf-8"
    )
    (only,) = measured(path)
    assert (only.sbp_mmhg, only.dbp_mmhg) == (118.5, 74.2)


@pytest.mark.parametrize(
    ("header", "cells", "message"),
    [
        (ALL, "118,,", r"row 2, column 'sbp_mmhg': '118' is given without dbp_mmhg; give both"),
        (ALL, ",74,", r"row 2, column 'dbp_mmhg': '74' is given without sbp_mmhg; give both"),
        (ALL, "74,118,", r"column 'dbp_mmhg': '118' is not below sbp_mmhg of the same row; .*swapped"),
        (ALL, "118,118,", r"column 'dbp_mmhg': '118' is not below"),
        (
            ALL,
            "118,9.9,",
            r"column 'dbp_mmhg': '9.9' is outside \[30, 160\]; .*in mmHg, not kPa",
        ),
        (
            ALL,
            "1180,74,",
            r"column 'sbp_mmhg': '1180' is outside .*; correct .*units\? .* in mmHg, not kPa\)",
        ),
        (ALL, ",,0.295", r"column 'lvet_ms': '0.295' is outside \[100, 500\]; .*in ms, not s"),
        (ALL, "118,low,", r"column 'dbp_mmhg': 'low' is not a number; write a number .* or nothing"),
        (ALL, "118,inf,", r"column 'dbp_mmhg': 'inf' is not a number"),
        ("sbp", "118", "column 'sbp': is not read, and looks like sbp_mmhg; call it sbp_mmhg, in mmHg"),
        ("sbp_kpa,dbp_kpa", "15,9", "looks like sbp_mmhg.*\n.*looks like dbp_mmhg"),
        ("sbp_mmgh", "118", "looks like sbp_mmhg"),
        (f"{ALL},lvet_ms", "118,74,300,300", "names a column twice: lvet_ms"),
    ],
)
def test_what_cannot_be_is_refused_with_place_value_and_remedy(
    tmp_path: Path, header: str, cells: str, message: str
) -> None:
    path = written(tmp_path, header, cells)
    with pytest.raises(RecordingError, match=message) as caught:
        read_subject_table(path)
    assert str(path) in str(caught.value)


def test_a_text_among_numbers_is_the_only_complaint_about_its_row(tmp_path: Path) -> None:
    with pytest.raises(RecordingError) as caught:
        read_subject_table(written(tmp_path, ALL, "118,low,"))
    assert len(caught.value.problems) == 1


def test_an_ejection_ends_before_the_next_beat(tmp_path: Path) -> None:
    path = tmp_path / "subjects.csv"
    fast = FIRST.replace(",60,90", ",180,90")
    path.write_text(f"{HEADER},lvet_ms\n{fast},340\n{SECOND},400\n", encoding="utf-8")
    with pytest.raises(
        RecordingError, match="row 2, column 'lvet_ms': '340' is no shorter than a beat"
    ) as caught:
        read_subject_table(path)
    assert len(caught.value.problems) == 1


@pytest.mark.parametrize("name", ["sbp_24h", "blood_pressure", "lvet_index", "spo2", "note"])
def test_other_columns_are_ignored_as_ever(tmp_path: Path, name: str) -> None:
    assert not measured(written(tmp_path, name, "7"))[0].has_pressures


def test_a_slip_beside_the_column_itself_is_ignored(tmp_path: Path) -> None:
    assert measured(written(tmp_path, f"{ALL},sbp", "118,74,,119"))[0].sbp_mmhg == 118.0


@pytest.mark.parametrize(
    "values", [{"sbp_mmhg": 118.0}, {"sbp_mmhg": 70.0, "dbp_mmhg": 80.0}, {"lvet_ms": 0.3}, {"sbp": 118.0}]
)
def test_a_row_that_cannot_be_is_none(values: dict[str, float]) -> None:
    with pytest.raises(ValidationError):
        ClinicalRow.from_plain(values)


def cohort_of(folder: Path, changes: dict[str, object]) -> Study:
    raw = read_merged(ROOT / "config.yaml") | {"cohort": str(ROOT / "data" / "virtual_volunteers")}
    return load_study(overlay(raw, changes), new_cohort=folder)


def test_settings_of_a_subject_hold_what_was_measured_of_it_and_of_nobody_else(tmp_path: Path) -> None:
    folder = write_cohort(tmp_path / "cohort")
    written(folder, ALL, "118,74,", ",,295")
    study = cohort_of(folder, {"cohort": str(folder)})
    assert study.cohort.clinical_of("S-1").to_measures().has_pressures
    first, second = (settings_of("ingest", study, subject=name) for name in ROWS)
    assert first["clinical_row"] == {"dbp_mmhg": 74.0, "lvet_ms": None, "sbp_mmhg": 118.0}
    assert second["clinical_row"]["lvet_ms"] == 295.0
    # what does not look at them depends on the context alone
    assert "clinical_row" not in settings_of("simulate", study, subject="S-1", prior="paper", shard="0")
    assert set(first["context"]) == set(HEADER.split(","))


def test_a_subject_outside_the_study_has_its_own(tmp_path: Path) -> None:
    folder = write_cohort(tmp_path / "cohort")
    written(folder, ALL, "118,74,", ",,295")
    settings = answer_settings(cohort_of(folder, {}), "calibrated", "S-1")
    assert settings.clinical_row.to_plain() == {"dbp_mmhg": 74.0, "lvet_ms": None, "sbp_mmhg": 118.0}
