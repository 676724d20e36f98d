"""Which recordings are visits of one person, and which group the person belongs to; all of it is optional.

Visits and groups are any text that can be seen. A person has a folder of results, and so a name that any file
system takes. Names are compared without regard to case, zeros, blanks and signs: folders may ignore case, and
people the others.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray, TextArray
from swesbi.context import SubjectVariable
from swesbi.recording.tables.table import Table, column_of, stood_before

MOST_NAMED: Final = 8
"""Visits and groups that are named one by one in a summary."""
EVERYONE: Final = "all"
"""What tables of groups call all persons together; no group has that name."""
VISITS: Final = (
    SubjectVariable(
        "person", "", "person", "person", "who was recorded; the rows of one name are visits of one person",
        "P01",
    ),
    SubjectVariable(
        "visit", "", "visit", "visit",
        "which visit of the person, with person; visits stand in the order of time", "before",
    ),
    SubjectVariable(
        "group", "", "group", "group",
        "group that the person belongs to, the same in all rows of a person", "treated",
    ),
)  # fmt: skip
"""What may be said of a recording's visit, in the order of its columns."""
VISIT_NAMES: Final = tuple(column.name for column in VISITS)
SEXES: Final = ("F", "M")
ENDINGS: Final = "s|id|name|label|no|nr|number"
LONGEST: Final = 64
LONGEST_FOLDER_BYTES: Final = 160
"""Names of files have 255 bytes, of which those of files that are being written need some more."""
NO_FOLDER: Final = '/\\:*?"<>|'
"""Signs that one file system or another does not take."""
RESULTS: Final = (".csv", ".h5", ".pdf", ".png")
"""Endings of the files that lie beside the folders of persons."""
Rule = tuple[Callable[[str], bool], str, str]
"""What a name must be, what to say of one that is not, and what to do."""
OF_NAMES: Final[tuple[Rule, ...]] = (
    (str.isprintable, "has a sign that cannot be seen", "type it anew, with letters, digits and blanks"),
    (lambda name: len(name) <= LONGEST, f"has more than {LONGEST} characters", "shorten it"),
)
OF_GROUPS: Final[tuple[Rule, ...]] = (
    *OF_NAMES,
    (
        lambda name: name.lower() != EVERYONE,
        "is what tables of groups call all persons together",
        "give the group another name, 'everyone' say, or leave the cells empty if there is one group",
    ),
)
OF_PERSONS: Final[tuple[Rule, ...]] = (
    *OF_NAMES,
    (
        lambda name: not set(name) & set(NO_FOLDER),
        "has a sign that the name of a folder, as each person has one, cannot have",
        f"write '-' in place of {' '.join(NO_FOLDER)}",
    ),
    (lambda name: name[0].isalnum(), "begins with neither a letter nor a digit", "put one first"),
    (lambda name: len(name.encode()) <= LONGEST_FOLDER_BYTES, "is too long for a folder", "shorten it"),
    (
        lambda name: not name.lower().endswith(RESULTS),
        "ends as files of results do, which lie beside the person's folder",
        "leave the ending out",
    ),
)
RULES: Final = {"person": OF_PERSONS, "visit": OF_NAMES, "group": OF_GROUPS}
"""By column."""


@dataclass(frozen=True)
class Visit:
    """Whose recording one is; empty texts where the table has none.

    Without ``person``, the subject is a person of their own.
    """

    person: str = ""
    visit: str = ""
    group: str = ""


@dataclass(frozen=True)
class Person:
    """A person with the names of their recordings and of the visits of these, in the order of the table.

    Without a person in the table, the name is the subject's. Other texts are empty where it has none.
    """

    name: str
    group: str
    subjects: tuple[str, ...]
    visits: tuple[str, ...]


def visit_rows(table: Table, age_years: FloatArray) -> list[Visit]:
    """Return whose recording each row is; ages, shape (n,), are NaN where wrong.

    Problems are noted in the table, ``subjects.csv``, which may have any of the columns, or none.
    """
    table.refuse_lookalikes({name: f"call it {name}" for name in VISIT_NAMES}, _resembles)
    if not any(name in table.cells for name in VISIT_NAMES):
        return [Visit()] * len(table.rows)
    table = table.with_empty(VISIT_NAMES)
    for name, rules in RULES.items():
        _check_texts(table, name, rules)
    _check_persons(table)
    _check_visits(table)
    _check_what_stays(table, age_years)
    return [Visit(*row) for row in zip(*(table.cells[name] for name in VISIT_NAMES), strict=True)]


def _check_texts(table: Table, column: str, rules: tuple[Rule, ...]) -> None:
    """Names are as they must be; of each the first thing that is wrong is noted."""
    fine = list(table.cells[column])
    for holds, reason, remedy in rules:
        broken = [text != "" and not holds(text) for text in fine]
        table.flag(column, np.array(broken), reason, remedy)
        fine = ["" if wrong else text for text, wrong in zip(fine, broken, strict=True)]


def _check_persons(table: Table) -> None:
    """Persons and groups have one spelling each, and a person's name is no other row's subject."""
    table.spelled_once("person")
    table.spelled_once("group")
    named = {*_lowered(table, "person")} - {""}
    borrowed = np.array([subject in named for subject in _lowered(table, "subject")])
    borrowed &= table.cells["person"] == ""
    reason = "is the name of a person in other rows, and this row names no person"
    table.flag("subject", borrowed, reason, "name the person in this row too, or rename one of them")


def _check_visits(table: Table) -> None:
    """A visit is somebody's, and several of one person have a name each."""
    person, visit = table.cells["person"], table.cells["visit"]
    remedy = "name the person, the same in all rows of the person, or leave the visit empty"
    table.flag("visit", (visit != "") & (person == ""), "is given without person", remedy)
    rows = Counter(person)
    unnamed = np.array([name != "" and rows[name] > 1 for name in person]) & (visit == "")
    remedy = "name the visit in the column visit, 'before' or 'week 4' say"
    table.flag("person", unnamed, "has several rows, of which this one names no visit", remedy)
    twice = stood_before([person, _lowered(table, "visit")]) & (person != "") & (visit != "")
    reason = "is the name of an earlier visit of the same person"
    table.flag("visit", twice, reason, "give each visit a name of its own; a visit is one recording")


def _check_what_stays(table: Table, age_years: FloatArray) -> None:
    """From visit to visit a person keeps sex and group, and does not grow younger."""
    sex, group = table.cells["sex"], table.cells["group"]
    who = np.where(table.cells["person"] == "", table.cells["subject"], table.cells["person"]).tolist()
    rows: dict[str, int] = {}
    first = [rows.setdefault(name, row) for row, name in enumerate(who)]
    other = np.isin(sex, SEXES) & np.isin(sex[first], SEXES) & (sex != sex[first])
    remedy = "correct the cell that is wrong, or the name of the person"
    table.flag("sex", other, "is not the sex in the first row of the same person", remedy)
    remedy = "write one group in all rows of the person; what differs by visit belongs into visit"
    table.flag("group", group != group[first], "is not the group in the first row of the same person", remedy)
    latest: dict[str, float] = {}
    younger = []
    for name, age in zip(who, age_years, strict=True):
        younger.append(age < latest.get(name, -np.inf))
        latest[name] = age
    remedy = "correct the cell, or put the rows of the person in the order of their visits"
    reason = "is below the age in the row before of the same person"
    table.flag("age_years", np.array(younger), reason, remedy)


def _lowered(table: Table, column: str) -> TextArray:
    return column_of(text.lower() for text in table.cells[column])


def _resembles(lowered: str, name: str) -> bool:
    """Tell whether a name is this one in capitals, in the plural, or with a word such as id."""
    return re.fullmatch(rf"{name}[\W_]*({ENDINGS})?[\W_]*", lowered) is not None


def persons_of(visits: Mapping[str, Visit]) -> tuple[Person, ...]:
    """Return the persons in the order of their first recordings, in the group of these; visits by subject."""
    subjects: dict[str, list[str]] = {}
    for subject, visit in visits.items():
        subjects.setdefault(visit.person or subject, []).append(subject)
    return tuple(
        Person(name, visits[own[0]].group, tuple(own), tuple(visits[subject].visit for subject in own))
        for name, own in subjects.items()
    )


def persons_in_words(visits: Mapping[str, Visit]) -> list[str]:
    """Say how many persons came how often, and how many are of each group; nothing where none is given."""
    persons, lines = persons_of(visits), []
    if any(visit.person for visit in visits.values()):
        times = Counter(len(person.subjects) for person in persons)
        counts = ", ".join(f"{number} with {visits}" for visits, number in sorted(times.items()))
        labels = tuple(dict.fromkeys(visit.visit for visit in visits.values() if visit.visit))
        named = f" ({_listed(labels)})" if labels else ""
        lines.append(f"persons: {len(persons)}, by number of visits: {counts}{named}.")
    if any(visit.group for visit in visits.values()):
        sizes = Counter(person.group or "none" for person in persons)
        lines.append(f"groups of persons: {_listed([f'{name} {size}' for name, size in sizes.items()])}.")
    return lines


def _listed(texts: tuple[str, ...] | list[str]) -> str:
    more = len(texts) - MOST_NAMED
    return ", ".join(texts[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
