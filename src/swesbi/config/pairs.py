"""Which two visits of which person are compared, and that they can be."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from swesbi.config.read import ConfigError
from swesbi.config.study import Study
from swesbi.recording.cohort import SUBJECTS
from swesbi.recording.visits import Person

LEAST_VISITS: Final = 2
NO_FOLDER: Final = ("/", "\\", "\0")


@dataclass(frozen=True)
class VisitPair:
    """Two visits of one person, the earlier first: what they are called, and the recordings."""

    person: str
    visits: tuple[str, str]
    subjects: tuple[str, str]


def labels_of(person: Person) -> tuple[str, ...]:
    """Return what a person's visits are called: by the recording where the table says nothing."""
    return tuple(visit or subject for visit, subject in zip(person.visits, person.subjects, strict=True))


def pairs_of(study: Study) -> tuple[VisitPair, ...]:
    """Return the first and last visit of every person outside the study who came twice or more."""
    came = [person for person in study.outside.persons if len(person.subjects) >= LEAST_VISITS]
    return tuple(visit_pair(study, person.name) for person in came)


def visit_pair(study: Study, person: str, earlier: str | None = None, later: str | None = None) -> VisitPair:
    """Return the visits of a person outside the study that are to be compared: the first and the last.

    Args:
        study: With ``new_subjects.cohort``.
        person: The person.
        earlier: Name of the visit to begin with; None: the first.
        later: Name of the visit to end with; None: the last.

    Raises:
        ConfigError: There is no such person or visit, or there are not two of them.
    """
    if study.config.new_subjects.cohort is None:
        raise ConfigError("new_subjects.cohort = null: names no folder, so there is no person to compare")
    table = Path(study.config.new_subjects.cohort) / SUBJECTS
    persons = {each.name: each for each in study.outside.persons}
    if person not in persons:
        raise ConfigError(f"person = {person!r}: {table} has {', '.join(persons)}")
    if any(character in person for character in NO_FOLDER) or person in (".", ".."):
        raise ConfigError(f"person = {person!r}: cannot name a folder; rename the person in {table}")
    found = persons[person]
    labels = labels_of(found)
    if len(labels) < LEAST_VISITS:
        raise ConfigError(
            f"person = {person!r}: has one visit in {table}, {labels[0]!r}, and a change needs two; give "
            "another row the same person and a visit of its own"
        )
    chosen = [labels[0] if earlier is None else earlier, labels[-1] if later is None else later]
    for name in chosen:
        if name not in labels:
            raise ConfigError(f"visit = {name!r}: person {person!r} has {', '.join(labels)} in {table}")
    if chosen[0] == chosen[1]:
        raise ConfigError(f"visit = {chosen[0]!r}: given as both visits of {person!r}; name two")
    first, second = (found.subjects[labels.index(name)] for name in chosen)
    return VisitPair(person, (chosen[0], chosen[1]), (first, second))
