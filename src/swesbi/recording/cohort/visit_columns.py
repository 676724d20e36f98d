"""The columns of ``subjects.csv`` that say which recordings are visits of one person, and what cannot be.

Visits and groups are any text that can be seen. A person has a folder of results, and so a name that any file
system takes. Names are compared without regard to case, zeros, blanks and signs: folders may ignore case, and
people the others.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.recording.cohort.visits import EVERYONE, VISIT_NAMES, Visit
from swesbi.recording.tables.table import Table

if TYPE_CHECKING:
    import pandas as pd

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
class _Columns:
    """The texts of n rows, empty where nothing is said; ``who`` is the person, or the subject without one."""

    person: pd.Series[str]
    visit: pd.Series[str]
    group: pd.Series[str]
    who: pd.Series[str]


def visit_rows(table: Table, age_years: FloatArray) -> list[Visit]:
    """Return whose recording each row is.

    Problems are noted in the table, which may have any of the columns, or none.

    Args:
        table: ``subjects.csv`` with n rows.
        age_years: Ages, NaN where wrong; shape (n,).
    """
    table.refuse_lookalikes({name: f"call it {name}" for name in VISIT_NAMES}, _resembles)
    if not any(name in table.cells for name in VISIT_NAMES):
        return [Visit()] * len(table.rows)
    person, visit, group = (_column(table, name) for name in VISIT_NAMES)
    for name, texts in zip(VISIT_NAMES, (person, visit, group), strict=True):
        _check_texts(table, name, texts, RULES[name])
    columns = _Columns(person, visit, group, person.where(person != "", _column(table, "subject")))
    _check_persons(table, columns)
    _check_visits(table, columns)
    _check_what_stays(table, columns, age_years)
    return [Visit(*row) for row in zip(person, visit, group, strict=True)]


def _column(table: Table, name: str) -> pd.Series[str]:
    """Return a column, empty where the table has none."""
    import pandas as pd  # a third of a second, which whoever only reads the configuration need not wait

    return pd.Series(table.cells.get(name, [""] * len(table.rows)), dtype=object)


def _check_texts(table: Table, column: str, texts: pd.Series[str], rules: tuple[Rule, ...]) -> None:
    """Names are as they must be; of each the first thing that is wrong is noted."""
    broken = [
        next((number for number, rule in enumerate(rules) if text and not rule[0](text)), -1)
        for text in texts
    ]
    for number, (_, reason, remedy) in enumerate(rules):
        table.flag(column, np.array(broken) == number, reason, remedy)


def _check_persons(table: Table, columns: _Columns) -> None:
    """Persons and groups have one spelling each, and a person's name is no other row's subject."""
    for name in ("person", "group"):
        if name in table.cells:
            table.spelled_once(name)
    named = set(columns.person.str.lower()) - {""}
    borrowed = (columns.person == "") & _column(table, "subject").str.lower().isin(named)
    reason = "is the name of a person in other rows, and this row names no person"
    table.flag("subject", _array(borrowed), reason, "name the person in this row too, or rename one of them")


def _check_visits(table: Table, columns: _Columns) -> None:
    """A visit is somebody's, and several of one person have a name each."""
    alone = (columns.visit != "") & (columns.person == "")
    remedy = "name the person, the same in all rows of the person, or leave the visit empty"
    table.flag("visit", _array(alone), "is given without person", remedy)
    known = columns.person != ""
    unnamed = known & columns.person.duplicated(keep=False) & (columns.visit == "")
    remedy = "name the visit in the column visit, 'before' or 'week 4' say"
    table.flag("person", _array(unnamed), "has several rows, of which this one names no visit", remedy)
    labels = columns.person.to_frame("person").assign(visit=columns.visit.str.lower())
    twice = labels.duplicated() & known & (columns.visit != "")
    reason = "is the name of an earlier visit of the same person"
    table.flag("visit", _array(twice), reason, "give each visit a name of its own; a visit is one recording")


def _check_what_stays(table: Table, columns: _Columns, age_years: FloatArray) -> None:
    """From visit to visit a person keeps sex and group, and does not grow younger."""
    sex = _column(table, "sex")
    first = sex.groupby(columns.who).transform("first")
    other = sex.isin(SEXES) & first.isin(SEXES) & (sex != first)
    remedy = "correct the cell that is wrong, or the name of the person"
    table.flag("sex", _array(other), "is not the sex in the first row of the same person", remedy)
    changed = columns.group != columns.group.groupby(columns.who).transform("first")
    if "group" in table.cells:
        remedy = "write one group in all rows of the person; what differs by visit belongs into visit"
        table.flag("group", _array(changed), "is not the group in the first row of the same person", remedy)
    age = columns.who.to_frame("who").assign(age=age_years)
    younger = age["age"] < age.groupby("who")["age"].shift()
    remedy = "correct the cell, or put the rows of the person in the order of their visits"
    reason = "is below the age in the row before of the same person"
    table.flag("age_years", _array(younger), reason, remedy)


def _array(rows: pd.Series[bool]) -> BoolArray:
    return np.asarray(rows, dtype=np.bool_)


def _resembles(lowered: str, name: str) -> bool:
    """Tell whether a name is this one in capitals, in the plural, or with a word such as id."""
    return re.fullmatch(rf"{name}[\W_]*({ENDINGS})?[\W_]*", lowered) is not None
