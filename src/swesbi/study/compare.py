"""Answer two visits of one person, or of all persons of a folder, and say what has changed between them."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from swesbi.answers.answer import Answer
from swesbi.answers.change import JOINT, OUTPUTS, TABLE, PersonChangeSettings, save_change
from swesbi.answers.files import OBSERVATION, RecordingRequest
from swesbi.artefacts import ArtefactError, Provenance, folder_made_whole
from swesbi.artefacts.csv import read_csv, write_csv
from swesbi.base.arrays import FloatArray
from swesbi.base.progress import LOGGER
from swesbi.base.terminal import EXIT_REFUSED
from swesbi.checks.truths import Truths
from swesbi.config.read import ConfigError, at_configuration, snakemake_options
from swesbi.config.study import Study, context_refusal, study_with, values_in
from swesbi.config.view import View
from swesbi.persons.change.groups import change_in_groups, group_lines
from swesbi.persons.change.stored import StoredChange, change_lines
from swesbi.persons.cohort.cohort import reference_among
from swesbi.persons.cohort.stored import CohortPosterior, change_table, person_table
from swesbi.recording.cohort.files import SUBJECTS
from swesbi.recording.cohort.visits import Visit
from swesbi.recording.observation import Observation
from swesbi.report.figures.cohort_posterior import draw_change_groups
from swesbi.report.figures.style import save_figure
from swesbi.study.answerer import OF_ALL, REFUSALS, Answerer, experiments_to_ask
from swesbi.study.job import typed_settings
from swesbi.study.results import experiment_files
from swesbi.study.stage import stage_code

CHANGES: Final = "change"
"""The folder of the changes, in that of an experiment; one below it for each person."""
CODE: Final = "swesbi.answers.change:save_change"
CODE_OF_GROUPS: Final = "swesbi.persons.change.groups:change_in_groups"
ALL_CHANGES: Final = "changes.csv"
"""The tables of all persons of a folder, one below the other."""
GROUP_OUTPUTS: Final = (
    "changes_groups.h5", "changes_groups.csv", "changes_persons.csv", "changes_groups.pdf",
    "changes_groups.png",
)  # fmt: skip
"""Of the groups of these persons."""
LEAST_VISITS: Final = 2


@dataclass(frozen=True)
class VisitPair:
    """Two visits of one person, the earlier first: what they are called, and the recordings."""

    person: str
    visits: tuple[str, str]
    subjects: tuple[str, str]


def main(options: argparse.Namespace) -> int:
    """Run `compare`; return 0 after printing the ratios, or 2 if a person is refused or groups fail."""
    options = at_configuration(options)
    study = study_with(options.cohort, options)
    if options.all:
        return _answer_all(study, options)
    if options.reference:
        raise ConfigError("--reference: names a group, which --all compares; leave it out for one person")
    # without a visit that cannot be used the pair would be another; a row without a person may be one
    lost = _lost_visits(study)
    if reasons := [*lost.get("", []), *lost.get(options.person, [])]:
        raise ConfigError("\n".join(reasons))
    pair = visit_pair(study, options.person, options.from_visit, options.to_visit)
    answerer, folder = _answerer(study, options)
    _answer(options.out or folder / pair.person, answerer, pair)
    return 0


def _lost_visits(study: Study) -> dict[str, list[str]]:
    """Return what is wrong with rows that cannot be used, by person; of those that name none under ''."""
    lost: dict[str, list[str]] = {}
    for subject, reason in study.outside.refused.items():
        lost.setdefault(study.outside.declared_visits.get(subject, Visit()).person, []).append(reason)
    return lost


def experiment_with_network(study: Study, asked: str | None) -> str:
    """Return the experiment asked for; else the first with a network, the package's among them."""
    names = experiments_to_ask(study, asked)
    return next((name for name in names if experiment_files(study, name).is_there), names[0])


def _answerer(study: Study, options: argparse.Namespace) -> tuple[Answerer, Path]:
    """Return what answers the visits, and where changes lie, a folder a person."""
    experiment = experiment_with_network(study, options.experiment)
    command = snakemake_options(options.config, options.overlay)
    experiment_files(study, experiment).check(command)
    folder = Path(study.config.results) / experiment / CHANGES
    return Answerer(study, (experiment,), command, required=True), folder


def _answer_all(study: Study, options: argparse.Namespace) -> int:
    """Compare every person who came twice, then groups of them; no refusal of one stops the others."""
    if options.from_visit is not None or options.to_visit is not None:
        raise ConfigError("--from and --to: name visits of one person; leave them out, or say --person")
    if options.reference:
        reference_among([person.group for person in study.outside.persons], options.reference)
    lost = _lost_visits(study)
    if unnamed := lost.pop("", []):
        raise ConfigError("\n".join(unnamed))
    refused = {person: "; ".join(reasons) for person, reasons in lost.items()}
    if not (pairs_of(study) or refused):
        raise ConfigError(
            f"--cohort = {str(study.outside.folder)!r}: no person has two visits; its subjects.csv needs the "
            "columns person and visit, with a row for each visit (docs/compare-and-plan.md)"
        )
    answerer, folder = _answerer(study, options)
    folder, (experiment,) = options.out or folder, answerer.experiments
    compared: list[VisitPair] = []
    for pair in [each for each in answered_pairs(study, experiment) if each.person not in refused]:
        try:
            _answer(folder / pair.person, answerer, pair)
        except OF_ALL:
            raise
        except REFUSALS as error:
            refused[pair.person] = str(error)
            LOGGER.warning("person %s is refused", pair.person)
        else:
            compared.append(pair)
    failed = _write_groups(folder, answerer, compared, refused, options.reference) if compared else ""
    for pair in pairs_of(study):
        if unknown := refused_visits(study, experiment, pair):
            refused[pair.person] = "; ".join(unknown)
    reasons = "".join(f"\nrefused: {person}: {reason}" for person, reason in refused.items())
    if not compared:
        raise ValueError(f"{study.outside.folder}: no person can be compared{reasons}")
    files = ", ".join((ALL_CHANGES, *(() if failed else GROUP_OUTPUTS)))
    print(
        f"\n{len(compared)} compared, {len(refused)} refused; written to {folder}: {files}, a folder a person"
        f"{reasons}{failed}"
    )
    return EXIT_REFUSED if refused or failed else 0


def _write_groups(
    folder: Path,
    answerer: Answerer,
    compared: Sequence[VisitPair],
    refused: Mapping[str, str],
    reference: str,
) -> str:
    """Write the table of all persons who are compared, and what has changed in groups of them.

    Where groups fail, none of their files is left, and the table stays. Why they fail is returned, in a line
    of its own; it is empty where they do not. ``reference`` is the group that others are compared with, where
    it is empty the first.
    """
    study, (experiment,) = answerer.study, answerer.experiments
    made_of = {folder / pair.person: pair.subjects[0] for pair in compared}
    table = pd.concat([read_csv(person / TABLE) for person in made_of], ignore_index=True)
    table.insert(0, "experiment", experiment)
    write_csv(folder / ALL_CHANGES, table)
    plain, code = groups_settings(study, experiment, refused, reference), stage_code(CODE_OF_GROUPS)
    try:
        with folder_made_whole(folder) as made:
            found = change_in_groups(
                [StoredChange.read(person / JOINT) for person in made_of],
                [Observation.read(person / first / OBSERVATION) for person, first in made_of.items()],
                **typed_settings(change_in_groups, plain),
            )
            by = Provenance("", seed=study.config.seed, settings=plain, code_hash=code)
            save_groups(found, made, by, study.outside.title, true_ratios(study.outside.folder, compared))
    except REFUSALS as error:
        for file in GROUP_OUTPUTS:
            (folder / file).unlink(missing_ok=True)
        return f"\nno change in groups: {error}"
    return ""


def groups_settings(
    study: Study, experiment: str, refused: Mapping[str, str], reference: str = ""
) -> dict[str, Any]:
    """Return what the change in groups depends on beside the changes: groups, and who is left out why.

    ``reference`` is the group that the others are compared with; empty: the first.
    """
    view = View(study, {"experiment": experiment})
    group_of = {person.name: person.group for person in study.outside.persons}
    persons = [pair.person for pair in answered_pairs(study, experiment)]
    said = [f"{person} is left out: {' '.join(reason.split())}" for person, reason in refused.items()]
    plain = view.together("prior", "change_groups", "cohort_posterior", "seed")
    return plain | {
        "cohort_posterior": {**plain["cohort_posterior"], "reference_group": reference},
        "groups": {person: group_of[person] for person in persons if group_of[person]},
        "left_out": [*left_out(study, experiment), *said],
    }


def true_ratios(folder: Path, pairs: Sequence[VisitPair]) -> FloatArray | None:
    """Return the true ratios of theta (d, 3) of the d pairs of a generated cohort; None of any other.

    The folder of one that was generated has a ``truth.csv``.
    """
    path = folder / "truth.csv"
    try:
        truths = Truths.read(path) if path.is_file() else Truths()
    except ArtefactError:
        return None  # somebody's own file of that name
    if any(subject not in truths for pair in pairs for subject in pair.subjects):
        return None
    return np.array([truths[later] / truths[earlier] for earlier, later in (p.subjects for p in pairs)])


def save_groups(
    found: CohortPosterior,
    folder: Path,
    made: Provenance,
    cohort_title: str,
    truth: FloatArray | None = None,
) -> None:
    """Write what has changed in groups into a folder that is there, and log it.

    The figure shows the true ratios, of shape (d, 3), if they are given.
    """
    groups, table, persons, *figures = (folder / name for name in GROUP_OUTPUTS)
    found.write(groups, made)
    write_csv(table, change_table(found))
    write_csv(persons, person_table(found))
    save_figure(draw_change_groups(found, cohort_title=cohort_title, truth=truth), *figures)
    for line in group_lines(found):
        LOGGER.info("%s", line)


def _answer(folder: Path, answerer: Answerer, pair: VisitPair) -> None:
    """Answer both visits, then the pair, put all of it into ``folder``, or nothing, and print the change."""
    if folder.exists() and not folder.is_dir():
        raise ValueError(
            f"{folder}: is a file where the results go; move it, or name another folder by --out"
        )
    study, (experiment,) = answerer.study, answerer.experiments
    plain = View(study.of_outside, {"experiment": experiment}).together("model", "changes", "cohort_title")
    plain |= {"person": pair.person, "visits": list(pair.visits)}
    settings = PersonChangeSettings.from_plain(plain)
    by = Provenance("", pair.person, study.config.seed, settings.to_plain(), stage_code(CODE))
    with folder_made_whole(folder) as made:
        visits = [_visit(made, answerer, pair, number) for number in (0, 1)]
        knowledge, answers = visits[0][0].knowledge, [answer for _, answer in visits]
        change = save_change(answers, knowledge, settings, by, made)
    print("\n".join([*change_lines(change), f"written to {folder}: {', '.join(OUTPUTS)}, a folder a visit"]))


def _visit(made: Path, answerer: Answerer, pair: VisitPair, number: int) -> tuple[RecordingRequest, Answer]:
    """Answer one visit as `infer` does."""
    visit, subject = pair.visits[number], pair.subjects[number]
    try:
        recording = answerer.request(subject)
        return recording, recording.answer_into(made / subject)[0]
    except OF_ALL:
        raise
    except ValueError as error:
        raise ValueError(
            f"visit {visit!r} of {pair.person!r} (recording {subject}): {error}; no change is told"
        ) from error


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
