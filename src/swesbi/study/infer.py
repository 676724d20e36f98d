"""Answer a recording, or a folder of them: posterior, sampling check, verdict, figures, a page, a table."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

from swesbi.answers.files import OtherAnswerError
from swesbi.answers.table import TABLE, AnswerRow, answer_text, answers_table, write_answers
from swesbi.artefacts.csv import read_csv
from swesbi.base.progress import LOGGER, Progress
from swesbi.base.terminal import EXIT_REFUSED
from swesbi.base.workers import WorkerKilledError, side_by_side
from swesbi.config.read import ConfigError, at_configuration, snakemake_options
from swesbi.config.study import Study, study_with
from swesbi.recording.cohort.files import RECORDINGS, SUBJECTS
from swesbi.study.answerer import OF_ALL, REFUSALS, Answerer, experiments_to_ask
from swesbi.verdict.summary import answer_summary

ANSWERS: Final = "answers"
"""The folder of all answers, in that from which the command is typed."""


@dataclass(frozen=True)
class Request:
    """Who is asked about, and how the answers are to be kept, a folder each below ``out``.

    Where none is named, all subjects of the folder are asked about. ``figures`` says what is drawn of each.
    """

    answerer: Answerer
    named: tuple[str, ...]
    out: Path
    force: bool
    figures: str


def main(options: argparse.Namespace) -> int:
    """Run `infer`; return 0 after printing the answers, or 2 if one of the recordings is refused."""
    typed_in = Path.cwd()
    options = at_configuration(options)
    study = study_with(folder_of(options.recordings), options)
    named = subjects_of(study, options.recordings, options.subject)
    answerer = Answerer(
        study,
        experiments_to_ask(study, options.experiment),
        snakemake_options(options.config, options.overlay),
        from_prior=options.from_prior,
        required=options.experiment is not None,
    )
    out = options.out or typed_in / ANSWERS / study.outside.folder.resolve().name
    request = Request(answerer, named, out, options.force, options.figures)
    if len(named) == 1:
        print(_given(request, *named)[0])
        return 0
    return _answer_all(request, options.workers)


def folder_of(paths: Sequence[Path]) -> Path:
    """Return the folder in whose ``swe`` recordings lie, or which is named itself."""
    folders = {_folder_of(path).resolve(): path for path in paths}
    if len(folders) > 1:
        raise ConfigError(
            f"{' and '.join(map(str, folders.values()))}: are of different folders; ask for one folder at a "
            "time, since errors are estimated from it and answers lie under its name"
        )
    return _folder_of(paths[0])


def _folder_of(path: Path) -> Path:
    above = (path.parent.parent, path.parent) if path.is_file() else (path,)
    if path.name == RECORDINGS:
        above = (path, path.parent)
    if found := next((folder for folder in above if (folder / SUBJECTS).is_file()), None):
        return found
    absent = f"no {SUBJECTS} stands {'in' if path.is_dir() else 'above'} it"
    if not path.exists():
        absent = "there is no such file or folder"
    raise ConfigError(
        f"{path}: {absent}; a recording lies in FOLDER/swe/, beside FOLDER/{SUBJECTS} and "
        "FOLDER/recording.yaml, which `swesbi template FOLDER` begins"
    )


def subjects_of(study: Study, paths: Sequence[Path], subject: str | None) -> tuple[str, ...]:
    """Return the subjects whose recordings are named; none where a whole folder, or its one table, is.

    The paths are recordings of the folder, or itself; ``subject`` is the one asked for, of a folder or of a
    table of several.
    """
    wholes = [study.outside.folder, study.outside.folder / RECORDINGS]
    if study.outside.layout.table.file is not None:
        wholes.append(study.outside.folder / study.outside.layout.table.file)
    whole = any(path.resolve() == each.resolve() for path in paths for each in wholes)
    named = {} if whole else {path: _subjects_in(study, path) for path in paths}
    if subject is None:
        return tuple(dict.fromkeys(name for names in named.values() for name in names))
    for path, names in named.items():
        if subject not in names:
            raise ConfigError(
                f"subject = {subject!r}: {path} is the recording of {', '.join(names)}; name the folder, "
                "or leave out the subject"
            )
    return (subject,)


def _subjects_in(study: Study, path: Path) -> tuple[str, ...]:
    """Return the subjects whose recording a file is; of one that cannot be used, its name."""
    files = {subject: file.resolve() for subject, file in study.outside.files.items()}
    if names := tuple(subject for subject, file in files.items() if file == path.resolve()):
        return names
    if path.stem not in files and path.parent.name == RECORDINGS:
        return (path.stem,)
    raise ConfigError(
        f"{path}: is nobody's recording; those of {SUBJECTS} lie in {study.outside.folder / RECORDINGS}, or "
        "in the table that recording.yaml names"
    )


def _given(request: Request, subject: str) -> tuple[str, AnswerRow]:
    """Answer one subject by the first that can: what to print, and its row of the table.

    An answer that is there, to just this, is kept.
    """
    asked, folder = request.answerer.request(subject), request.out / subject
    verdict = None if request.force else asked.kept_in(folder, request.figures)
    if verdict is not None:
        lines = [
            f"{subject}: {verdict.sentence}",
            f"answered before, and nothing has changed since: {folder.resolve()}",
        ]
    else:
        answer, _ = asked.answer_into(folder, force=request.force, figures=request.figures)
        verdict = answer.verdict
        files = ", ".join(sorted(path.name for path in folder.iterdir() if path.is_file()))
        lines = [
            *(f"{subject}: {sentence}" for sentence in asked.left_out),
            asked.note,
            answer_text(answer),
            f"written to {folder.resolve()}: {files}",
        ]
    noise, notes = asked.recording.noise, "; ".join(asked.left_out)
    row = AnswerRow(subject, asked.experiment, answer_summary(verdict), noise=noise, notes=notes)
    return "\n".join(filter(None, lines)), row


def _answer_all(request: Request, workers: int) -> int:
    """Answer every subject that is asked for; no refusal stops it. The table is of the whole folder alone."""
    answerer = request.answerer
    subjects = request.named or answerer.subjects
    if not (request.named or request.force):
        check_table(request.out, subjects)
    refused = {name: why for name, why in answerer.folder.refused.items() if name in subjects}
    usable = [name for name in subjects if name not in refused]
    given: dict[str, AnswerRow] = {}
    progress = Progress("answers", len(usable), unit="recording")
    for subject, found in _found(request, usable, workers):
        if isinstance(found, str):
            refused[subject] = found
            LOGGER.warning("subject %s is refused", subject)
        else:
            text, given[subject] = found
            print(text, flush=True)
        progress.step(note=subject)
    table = ""
    if not request.named:
        asked = ", ".join(answerer.experiments)
        rows = given | {name: AnswerRow(name, asked, None, why) for name, why in refused.items()}
        write_answers(answers_table([rows[subject] for subject in subjects]), request.out)
        table = f"; {(request.out / TABLE).resolve()}, .xlsx"
    print(f"\n{len(given)} answered, {len(refused)} refused{table}")
    for subject, reason in refused.items():
        print(f"refused: {subject}: {reason}")
    return EXIT_REFUSED if refused else 0


def _found(
    request: Request, subjects: Sequence[str], workers: int
) -> Iterator[tuple[str, tuple[str, AnswerRow] | str]]:
    """Yield the answer to each subject, or why there is none, as they are found."""
    answer = partial(_given_or_refused, request)
    if workers == 1:
        yield from ((subject, answer(subject)) for subject in subjects)
        return
    for subject, found in side_by_side(answer, subjects, workers):
        if isinstance(found, WorkerKilledError):
            found = f"{found}; type the same again with fewer --workers: other answers are kept"
        yield subject, found


def _given_or_refused(request: Request, subject: str) -> tuple[str, AnswerRow] | str:
    try:
        return _given(request, subject)
    except OF_ALL:
        raise
    except REFUSALS as error:
        return str(error)
    except MemoryError as error:
        return f"the memory ran out {error}".strip()


def check_table(folder: Path, subjects: Sequence[str]) -> None:
    """Refuse to write over a table with other subjects: that of another folder of the same name."""
    path = folder / TABLE
    answered = list(read_csv(path)["subject"]) if path.is_file() else []
    others = dict.fromkeys(name for name in answered if name not in subjects)
    if others:
        raise OtherAnswerError(
            f"{path}: has the answers of {', '.join(others)}, who are not in this folder; name another "
            "folder by --out, or write over it by --force"
        )
