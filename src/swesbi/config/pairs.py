"""Which two visits of which person are compared, that they can be, and who is left out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from swesbi.config.read import ConfigError
from swesbi.config.study import Study, context_refusal, values_in
from swesbi.recording.cohort.files import SUBJECTS

LEAST_VISITS: Final = 2


@dataclass(frozen=True)
class VisitPair:
    """Two visits of one person, the earlier first: what they are called, and the recordings."""

    person: str
    visits: tuple[str, str]
    subjects: tuple[str, str]


def pairs_of(study: Study) -> tuple[VisitPair, ...]:
    """Return the first and last visit of every person outside the study with two or more."""
    came = [person for person in study.outside.persons if len(person.subjects) >= LEAST_VISITS]
    return tuple(visit_pair(study, person.name) for person in came)


def answered_pairs(study: Study, experiment: str) -> tuple[VisitPair, ...]:
    """Return those pairs of which an experiment answers both visits."""
    return tuple(pair for pair in pairs_of(study) if not refused_visits(study, experiment, pair))


def left_out(study: Study, experiment: str) -> tuple[str, ...]:
    """Return a sentence on those who came once, and one on each visit that an experiment refuses."""
    once = [person.name for person in study.outside.persons if len(person.subjects) < LEAST_VISITS]
    sentences = [f"left out with one visit, since a change needs two: {', '.join(once)}"] if once else []
    for pair in pairs_of(study):
        refused = refused_visits(study, experiment, pair)
        sentences += [f"{pair.person} is left out: {sentence}" for sentence in refused]
    return tuple(sentences)


def refused_visits(study: Study, experiment: str, pair: VisitPair) -> tuple[str, ...]:
    """Return a sentence on each visit of a pair whose heart the network of an experiment does not know."""
    return tuple(
        f"visit {visit!r} (recording {subject}) is refused, {reason}"
        for visit, subject in zip(pair.visits, pair.subjects, strict=True)
        if (reason := "; ".join(values_in(context_refusal(study, experiment, subject))))
    )


def visit_pair(study: Study, person: str, earlier: str | None = None, later: str | None = None) -> VisitPair:
    """Return two visits of a person outside the study: those named, else the first and the last."""
    table = study.outside.folder / SUBJECTS
    persons = {each.name: each for each in study.outside.persons}
    if person not in persons:
        raise ConfigError(f"person = {person!r}: {table} has {', '.join(persons)}")
    found = persons[person]
    # a visit without a name is called by its recording
    labels = [visit or subject for visit, subject in zip(found.visits, found.subjects, strict=True)]
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
