"""Optional columns of subjects.csv: what was measured of a subject, and persons, visits and groups."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from cohorts import HEADER, ROWS, write_cohort
from rules import settings_of
from study_copy import ROOT

from swesbi.__main__ import main
from swesbi.config.read import ConfigError, overlay, read_merged
from swesbi.config.study import Study, load_study
from swesbi.recording.cohort.clinical import ClinicalMeasures
from swesbi.recording.cohort.subjects import read_subject_table
from swesbi.recording.cohort.visits import Person, Visit, persons_of
from swesbi.recording.problems import RecordingError
from swesbi.study.answerer import answer_settings

PERSONS, CLINICAL = "person,visit,group", "sbp_mmhg,dbp_mmhg,lvet_ms"
ROW = "{},F,{},1.7,60,90,34,0.8"


def written(path: Path, header: str, *cells: str, ages: tuple[float, ...] = (), sexes: str = "") -> Path:
    """``subjects.csv`` with subjects S-0, S-1, ... and further columns, whose cells are given."""
    lines = []
    for number, own in enumerate(cells):
        row = ROW.format(f"S-{number}", ages[number] if ages else 25)
        lines.append(f"{row.replace(',F,', f',{sexes[number]},') if sexes else row},{own}")
    path.write_text("\n".join([f"{HEADER},{header}", *lines]) + "\n", encoding="utf-8")
    return path


@pytest.fixture
def table(tmp_path: Path) -> Path:
    return tmp_path / "subjects.csv"


def measured(path: Path) -> list[ClinicalMeasures]:
    return [row.to_measures() for row in read_subject_table(path).clinical.values()]


def refused(path: Path) -> str:
    with pytest.raises(RecordingError) as caught:
        read_subject_table(path)
    (problem,) = caught.value.problems
    return str(problem)


def study_of(folder: Path, changes: dict[str, object]) -> Study:
    raw = read_merged(ROOT / "config.yaml") | {"cohort": str(ROOT / "data" / "virtual_volunteers")}
    return load_study(overlay(raw, changes), new_cohort=folder)


def test_without_the_columns_nothing_is_measured_and_each_subject_is_a_person(table: Path) -> None:
    table.write_text("\n".join([HEADER, *ROWS.values()]) + "\n", encoding="utf-8")
    read = read_subject_table(table)
    assert not any(one.has_pressures or one.has_ejection_time for one in measured(table))
    assert read.visits == {"S-1": Visit("", "", ""), "s_2x": Visit("", "", "")}
    assert persons_of(read.visits) == (
        Person("S-1", "", ("S-1",), ("",)),
        Person("s_2x", "", ("s_2x",), ("",)),
    )


def test_what_is_there_is_read_and_an_empty_cell_was_not_measured(table: Path) -> None:
    first, second = measured(written(table, CLINICAL, "118,74,", ",NaN,295.5"))
    assert (first.sbp_mmhg, first.dbp_mmhg) == (118.0, 74.0) and math.isnan(first.lvet_ms)
    assert second.lvet_ms == 295.5 and not second.has_pressures and second.has_ejection_time
    (swapped,) = measured(written(table, "dbp_mmhg,sbp_mmhg", "70,110"))
    assert (swapped.sbp_mmhg, swapped.dbp_mmhg) == (110.0, 70.0) and not swapped.has_ejection_time


def test_a_text_among_numbers_is_the_only_complaint_about_its_row(table: Path) -> None:
    assert "'low' is not a number" in refused(written(table, CLINICAL, "118,low,"))


def test_a_slip_beside_the_column_itself_is_ignored(table: Path) -> None:
    assert measured(written(table, f"{CLINICAL},sbp", "118,74,,119"))[0].sbp_mmhg == 118.0


@pytest.mark.parametrize(
    "name",
    ["sbp_24h", "blood_pressure", "lvet_index", "spo2", "visit_date", "personality", "grouped_by", "patient"],
)
def test_other_columns_are_ignored_as_ever(table: Path, name: str) -> None:
    read = read_subject_table(written(table, name, "7"))
    assert read.visits == {"S-0": Visit()} and not read.clinical["S-0"].to_measures().has_pressures


def test_rows_of_one_person_are_visits_in_the_order_of_the_file(table: Path) -> None:
    cells = ("7º Müller B.,+4 weeks,5 mg/kg", ",,", "NA,before,$", "7º Müller B.,  later ,5 mg/kg")
    visits = read_subject_table(written(table, PERSONS, *cells)).visits
    assert visits["S-3"] == Visit("7º Müller B.", "later", "5 mg/kg")
    assert persons_of(visits) == (
        Person("7º Müller B.", "5 mg/kg", ("S-0", "S-3"), ("+4 weeks", "later")),
        Person("S-1", "", ("S-1",), ("",)),
        Person("NA", "$", ("S-2",), ("before",)),
    )


@pytest.mark.parametrize(
    ("header", "cells", "person"),
    [
        ("group", "x", Person("S-0", "x", ("S-0",), ("",))),
        ("visit,person", "NaN, nan ", Person("nan", "", ("S-0",), ("NaN",))),
        ("person", "S-0", Person("S-0", "", ("S-0",), ("",))),
    ],
)
def test_any_of_the_columns_may_be_left_out_and_their_order_is_free(
    table: Path, header: str, cells: str, person: Person
) -> None:
    assert persons_of(read_subject_table(written(table, header, cells)).visits) == (person,)


def test_a_table_of_a_spreadsheet_keeps_names_that_look_like_numbers(table: Path) -> None:
    header = f"{HEADER},note,{PERSONS},{CLINICAL},".replace(",", ";").replace(";ivsd", "; ivsd")
    rows = "001;F;25;1,7;60;90;34;0,8;x;1,5;2.0;007;118,5;74,2;;\r\nB;M;27;1,68;64;84;31;0,74 ;;;;;;;;\r\n"
    table.write_bytes(f"{header}\r\n{rows}{';' * 15}\r\n".encode("utf-8-sig"))
    read = read_subject_table(table)
    assert list(read.rows) == ["001", "B"]
    assert (read.rows["001"].bsa_m2, read.rows["001"].ivsd_cm, read.rows["B"].ivsd_cm) == (1.7, 0.8, 0.74)
    assert read.visits == {"001": Visit("1,5", "2.0", "007"), "B": Visit()}
    assert (measured(table)[0].sbp_mmhg, measured(table)[0].dbp_mmhg) == (118.5, 74.2)


def test_a_person_keeps_their_sex(table: Path) -> None:
    message = refused(written(table, PERSONS, "P,1,", "Q,1,", "P,2,", "P,3,", sexes="FMMF"))
    assert "row 4, column 'sex': 'M' is not the sex in the first row of the same person; correct" in message


def test_an_age_may_stay_and_does_not_run_backwards(table: Path) -> None:
    cells = ("P,1,", "Q,1,", "P,2,", "P,3,")
    assert len(read_subject_table(written(table, PERSONS, *cells, ages=(30, 20, 30, 31))).rows) == 4
    message = refused(written(table, PERSONS, *cells, ages=(30, 20, 29.5, 31)))
    assert "row 4, column 'age_years': '29.5' is below the age in the row before of the same per" in message


@pytest.fixture
def cohort(tmp_path: Path) -> Path:
    """S-1 and s_2x as visits of one person, with cuff pressures at the first, and then the ejection."""
    folder = write_cohort(tmp_path / "cohort")
    rows = zip(ROWS.values(), ("P,before,g,118,74,", "P,after,g,,,295"), strict=True)
    lines = [f"{HEADER},{PERSONS},{CLINICAL}", *(f"{row.replace(',M,', ',F,')},{own}" for row, own in rows)]
    (folder / "subjects.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder


def test_a_study_knows_persons_and_visits_of_its_subjects_and_of_those_outside(cohort: Path) -> None:
    study = study_of(cohort, {})
    assert study.cohort.visits == dict.fromkeys("ABCDEFGH", Visit())
    assert study.outside.visits == {"S-1": Visit("P", "before", "g"), "s_2x": Visit("P", "after", "g")}
    assert study.outside.persons == (Person("P", "g", ("S-1", "s_2x"), ("before", "after")),)
    answered = answer_settings(study, "calibrated", "S-1")
    assert answered.clinical_row.to_plain() == {"dbp_mmhg": 74.0, "lvet_ms": None, "sbp_mmhg": 118.0}


def test_a_study_on_some_subjects_has_their_visits_in_the_order_of_the_table(cohort: Path) -> None:
    own = {"cohort": str(cohort)}
    both = study_of(cohort, own | {"subjects": ["s_2x", "S-1"]})
    assert both.cohort.persons[0].visits == ("before", "after")
    assert study_of(cohort, own | {"subjects": ["s_2x"]}).cohort.persons == (
        Person("P", "g", ("s_2x",), ("after",)),
    )


def test_a_study_refuses_visits_that_cannot_be(cohort: Path) -> None:
    path = cohort / "subjects.csv"
    path.write_text(path.read_text().replace("after", "before"))
    refused = "row 3, column 'visit': 'before' is the name of an earlier visit"
    assert any(refused in reason for reason in study_of(cohort, {}).outside.refused.values())
    with pytest.raises(ConfigError, match=refused):
        study_of(cohort, {"cohort": str(cohort)})


def test_stages_depend_on_what_was_measured_of_their_subject_alone_and_never_on_visits(cohort: Path) -> None:
    study = study_of(cohort, {"cohort": str(cohort)})
    first, second = (settings_of("ingest", study, subject=name) for name in ROWS)
    assert first["clinical_row"] == {"dbp_mmhg": 74.0, "lvet_ms": None, "sbp_mmhg": 118.0}
    assert second["clinical_row"]["lvet_ms"] == 295.0
    # what does not look at them depends on the context alone
    assert "clinical_row" not in settings_of("simulate", study, subject="S-1", prior="paper", shard="0")
    assert set(first["context"]) == set(HEADER.split(","))
    path = cohort / "subjects.csv"
    path.write_text(path.read_text().replace(PERSONS, "a,b,c"))
    assert settings_of("ingest", study_of(cohort, {"cohort": str(cohort)}), subject="S-1") == first


def test_the_template_s_columns_can_be_named_and_filled(tmp_path: Path) -> None:
    assert main(["template", str(tmp_path / "cohort")]) == 0
    path = tmp_path / "cohort" / "subjects.csv"
    lines = path.read_text().splitlines()
    assert all(any(line.startswith(f"# {name} ") for line in lines) for name in PERSONS.split(","))
    path.write_text(
        "\n".join([*lines[:-1], f"{lines[-1]},{PERSONS}", "S01,F,31,1.71,62,95,36,0.82,P01,before,g"])
    )
    assert read_subject_table(path).visits == {"S01": Visit("P01", "before", "g")}
