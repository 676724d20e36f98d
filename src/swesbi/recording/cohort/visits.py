"""Which recordings are visits of one person, and which group the person belongs to; all of it is optional."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from swesbi.context import SubjectVariable

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


@dataclass(frozen=True)
class Visit:
    """Whose recording one is; empty texts where the table has none.

    Attributes:
        person: Name of the person; without it the subject is a person of their own.
        visit: Name of the visit.
        group: Name of the person's group.
    """

    person: str = ""
    visit: str = ""
    group: str = ""


@dataclass(frozen=True)
class Person:
    """A person with all their visits, in the order of the table.

    Attributes:
        name: The person's name; the subject's, where the table names no person.
        group: The person's group; empty where the table has none.
        subjects: The recordings.
        visits: Names of their visits, in the same order; empty where the table has none.
    """

    name: str
    group: str
    subjects: tuple[str, ...]
    visits: tuple[str, ...]


def persons_of(visits: Mapping[str, Visit]) -> tuple[Person, ...]:
    """Return the persons in the order of their first recordings.

    Args:
        visits: Visits by subject, in the table's order; a person's group is that of their first.
    """
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
