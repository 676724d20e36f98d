"""Persons, visits and groups: optional columns of names, checked against each other."""

from __future__ import annotations

from pathlib import Path

import pytest
from cohorts import HEADER, ROWS, write_cohort
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rules import settings_of
from study_copy import ROOT

from swesbi.__main__ import main
from swesbi.config.read import ConfigError, overlay, read_merged
from swesbi.config.study import Study, load_study
from swesbi.recording.cohort.subjects import read_subject_table
from swesbi.recording.cohort.visits import Person, Visit, persons_of
from swesbi.recording.problems import RecordingError

ALL = "person,visit,group"
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


def refused(path: Path) -> str:
    with pytest.raises(RecordingError) as caught:
        read_subject_table(path)
    assert all(problem.file == str(path) for problem in caught.value.problems)
    return str(caught.value)


def test_a_cohort_without_the_columns_has_a_person_a_subject(table: Path) -> None:
    table.write_text("\n".join([HEADER, *ROWS.values()]) + "\n", encoding="utf-8")
    visits = read_subject_table(table).visits
    assert visits == {"S-1": Visit("", "", ""), "s_2x": Visit("", "", "")}
    assert persons_of(visits) == (
        Person("S-1", "", ("S-1",), ("",)),
        Person("s_2x", "", ("s_2x",), ("",)),
    )


def test_rows_of_one_person_are_visits_in_the_order_of_the_file(table: Path) -> None:
    cells = ("7º Müller B.,+4 weeks,5 mg/kg", ",,", "NA,before,$", "7º Müller B.,  later ,5 mg/kg")
    visits = read_subject_table(written(table, ALL, *cells)).visits
    assert visits["S-3"] == Visit("7º Müller B.", "later", "5 mg/kg")
    assert persons_of(visits) == (
        Person("7º Müller B.", "5 mg/kg", ("S-0", "S-3"), ("+4 weeks", "later")),
        Person("S-1", "", ("S-1",), ("",)),
        Person("NA", "$", ("S-2",), ("before",)),
    )


@pytest.mark.parametrize(
    ("header", "cells", "person"),
    [
        ("group", ("x",), Person("S-0", "x", ("S-0",), ("",))),
        ("person", ("P",), Person("P", "", ("S-0",), ("",))),
        ("visit,person", ("one,P",), Person("P", "", ("S-0",), ("one",))),
        ("visit,person", ("NaN, nan ",), Person("nan", "", ("S-0",), ("NaN",))),
        ("person", ("S-0",), Person("S-0", "", ("S-0",), ("",))),
    ],
)
def test_any_of_the_columns_may_be_left_out_and_their_order_is_free(
    table: Path, header: str, cells: tuple[str, ...], person: Person
) -> None:
    assert persons_of(read_subject_table(written(table, header, *cells)).visits) == (person,)


def test_names_that_look_like_numbers_stay_as_they_are(table: Path) -> None:
    header = f"{HEADER},{ALL}".replace(",", ";")
    table.write_text(f"{header}\nx;F;25;1,7;60;90;34;0,8;1,5;2.0;007\n", encoding="utf-8")
    read = read_subject_table(table)
    assert read.visits["x"] == Visit("1,5", "2.0", "007") and read.rows["x"].bsa_m2 == 1.7


@pytest.mark.parametrize(
    ("header", "cells", "message"),
    [
        (ALL, ("P,1,", "P,1,"), r"row 3, column 'visit': '1' is the name of an earlier visit of the same"),
        (
            ALL,
            ("P,One,", "Q,one,", "P,one,"),
            r"row 4, column 'visit': 'one' is the name of an earlier visit",
        ),
        (
            "group",
            ("All",),
            r"row 2, column 'group': 'All' is what tables of groups call all persons together",
        ),
        (ALL, ("P,1,", ",2,"), r"row 3, column 'visit': '2' is given without person; name the person"),
        (ALL, ("P,1,", "P,,"), r"row 3, column 'person': 'P' has several rows, of which this one names no"),
        ("person", ("P", "P"), r"row 2, column 'person': 'P' has several rows(.|\n)*row 3, column 'person'"),
        (
            ALL,
            ("P,1,a", "P,2,b"),
            r"row 3, column 'group': 'b' is not the group in the first row of the same",
        ),
        (ALL, ("P,1,", "p,2,"), r"row 3, column 'person': 'p' differs from an earlier person in case, zeros"),
        (
            ALL,
            ("P,,drug", "Q,,Drug"),
            r"row 3, column 'group': 'Drug' differs from an earlier group in case",
        ),
        ("person", ("s-1", ""), r"row 3, column 'subject': 'S-1' is the name of a person in other rows"),
        ("Person", ("P",), "column 'Person': is not read, and looks like person; call it person, or by"),
        ("persn", ("P",), "looks like person"),
        (ALL, ("2024/001,1,",), r"row 2, column 'person': '2024/001' has a sign .* folder, .* write '-' in"),
        ("person", ("=1+1",), "'=1.1' begins with neither a letter nor a digit; put one first"),
        ("person", ("..",), "begins with neither a letter nor a digit"),
        ("person", ("changes.csv",), "'changes.csv' ends as files of results do"),
        ("person", ("ж" * 65,), "'ж{60}...' has more than 64 characters; shorten it"),
        ("person", ("漢" * 64,), "is too long for a folder"),
        (
            ALL,
            ("P,be\u200bfore,",),
            r"column 'visit': 'be\\u200bfore' .with U\+200B. has a sign that cannot be seen; type it",
        ),
        (
            "group",
            ("\x1b[2Jdrug",),
            r"column 'group': '\\x1b\[2Jdrug' .with U\+001B. has a sign that",
        ),
        ("person", ("Müller", "Mu\u0308ller"), r"row 3, column 'person': 'M.+ller' differs from an earlier"),
        (f"{ALL},visit", ("P,1,,2",), "names a column twice: visit"),
    ],
)
def test_what_cannot_be_is_refused_with_place_value_and_remedy(
    table: Path, header: str, cells: tuple[str, ...], message: str
) -> None:
    with pytest.raises(RecordingError, match=message):
        read_subject_table(written(table, header, *cells))


def test_a_person_keeps_their_sex(table: Path) -> None:
    message = refused(written(table, ALL, "P,1,", "Q,1,", "P,2,", "P,3,", sexes="FMMF"))
    assert "row 4, column 'sex': 'M' is not the sex in the first row of the same person; correct" in message
    assert "\n" not in message


def test_an_age_may_stay_and_does_not_run_backwards(table: Path) -> None:
    cells = ("P,1,", "Q,1,", "P,2,", "P,3,")
    assert len(read_subject_table(written(table, ALL, *cells, ages=(30, 20, 30, 31))).rows) == 4
    message = refused(written(table, ALL, *cells, ages=(30, 20, 29.5, 31)))
    assert "row 4, column 'age_years': '29.5' is below the age in the row before of the same per" in message
    assert "in the order of their visits" in message and "\n" not in message


@pytest.mark.parametrize("name", ["visit_date", "note", "personality", "grouped_by", "patient"])
def test_other_columns_are_ignored_as_ever(table: Path, name: str) -> None:
    assert read_subject_table(written(table, name, "7")).visits == {"S-0": Visit()}


def test_a_fault_of_many_rows_is_told_in_a_few_lines(table: Path) -> None:
    message = refused(written(table, "person", *["P"] * 9))
    assert message.startswith("6 problems") and "likewise in 4 more rows" in message


WORDS = st.sampled_from(["", "", "P", "p", "Q", "S-1", "before", "after", "NaN", " x ", "1,5", "ß"])

GOOD = st.sampled_from([("P", "before", "x"), ("P", "after", "x"), ("Q", "before", ""), ("", "", "x")])
AGES = st.lists(st.integers(20, 22), min_size=5, max_size=5)


def test_any_columns_are_read_or_refused(table: Path) -> None:
    read: list[bool] = []

    @settings(
        max_examples=80,
        derandomize=True,
        database=None,
        deadline=None,
        suppress_health_check=[HealthCheck.function_scoped_fixture],
    )
    @given(
        st.lists(st.one_of(GOOD, GOOD, st.tuples(WORDS, WORDS, WORDS)), min_size=1, max_size=5),
        st.one_of(AGES, AGES.map(sorted)),
        st.one_of(st.just("F" * 5), st.text("FM", min_size=5, max_size=5)),
    )
    def check(cells: list[tuple[str, str, str]], ages: list[int], sexes: str) -> None:
        quoted = (",".join(f'"{cell}"' for cell in row) for row in cells)
        try:
            visits = read_subject_table(written(table, ALL, *quoted, ages=tuple(ages), sexes=sexes)).visits
        except RecordingError as error:
            assert str(table) in str(error)
            return
        persons = persons_of(visits)
        read.append(len(persons) < len(visits))
        assert [name for name in visits] == [f"S-{number}" for number in range(len(cells))]
        assert sorted(name for person in persons for name in person.subjects) == sorted(visits)
        assert len({person.name.lower() for person in persons}) == len(persons)
        for person in persons:
            numbers = [int(subject.removeprefix("S-")) for subject in person.subjects]
            assert numbers == sorted(numbers)
            assert len({ages[number] for number in numbers}) == 1 or numbers == sorted(
                numbers, key=lambda number: ages[number]
            )
            assert len({sexes[number] for number in numbers}) == 1
            assert {visits[subject].group for subject in person.subjects} == {person.group}
            assert len(numbers) == 1 or (all(person.visits) and len(set(person.visits)) == len(numbers))

    check()
    assert {True, False} == set(read)


def study_of(folder: Path, changes: dict[str, object]) -> Study:
    raw = read_merged(ROOT / "config.yaml") | {"cohort": str(ROOT / "data" / "virtual_volunteers")}
    return load_study(overlay(raw, changes), new_cohort=folder)


@pytest.fixture
def cohort(tmp_path: Path) -> Path:
    """S-1 and s_2x as visits of one person."""
    folder = write_cohort(tmp_path / "cohort")
    rows = zip(ROWS.values(), ("P,before,g", "P,after,g"), strict=True)
    text = "\n".join([f"{HEADER},{ALL}", *(f"{row.replace(',M,', ',F,')},{own}" for row, own in rows)])
    (folder / "subjects.csv").write_text(text + "\n", encoding="utf-8")
    return folder


def test_a_study_knows_persons_and_visits_of_its_subjects_and_of_those_outside(cohort: Path) -> None:
    study = study_of(cohort, {})
    assert study.cohort.visits == dict.fromkeys("ABCDEFGH", Visit())
    assert [person.name for person in study.cohort.persons] == list("ABCDEFGH")
    assert study.outside.visits == {"S-1": Visit("P", "before", "g"), "s_2x": Visit("P", "after", "g")}
    assert study.outside.persons == (Person("P", "g", ("S-1", "s_2x"), ("before", "after")),)


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


def test_no_stage_depends_on_them(cohort: Path) -> None:
    with_visits = settings_of("ingest", study_of(cohort, {"cohort": str(cohort)}), subject="S-1")
    path = cohort / "subjects.csv"
    path.write_text("\n".join(line.rsplit(",", 3)[0] for line in path.read_text().splitlines()) + "\n")
    assert settings_of("ingest", study_of(cohort, {"cohort": str(cohort)}), subject="S-1") == with_visits


def test_the_template_s_columns_can_be_named_and_filled(tmp_path: Path) -> None:
    assert main(["template", str(tmp_path / "cohort")]) == 0
    path = tmp_path / "cohort" / "subjects.csv"
    lines = path.read_text().splitlines()
    assert all(any(line.startswith(f"# {name} ") for line in lines) for name in ALL.split(","))
    path.write_text(
        "\n".join([*lines[:-1], f"{lines[-1]},{ALL}", "S01,F,31,1.71,62,95,36,0.82,P01,before,g"])
    )
    assert read_subject_table(path).visits == {"S01": Visit("P01", "before", "g")}
