"""Answer a recording, or a folder of them: posterior, certificate, verdict, figures, a page, a table."""

from __future__ import annotations

import argparse
import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from swesbi.base.processes import WorkerKilledError, side_by_side
from swesbi.base.progress import Progress
from swesbi.config.read import ConfigError, at_configuration, snakemake_options
from swesbi.recording.cohort import SUBJECTS
from swesbi.study.answering import (
    EXIT_REFUSED,
    Answerer,
    OtherAnswerError,
    experiments_to_ask,
    is_everyones,
    study_with,
)

if TYPE_CHECKING:
    from swesbi.verdict.answers import Answer as Told

LOGGER: Final = logging.getLogger("swesbi")
ANSWERS: Final = "answers"
"""The folder of all answers, in that from which the command is typed."""


@dataclass(frozen=True)
class Request:
    """Who is asked about, and how the answers are to be kept.

    Attributes:
        answerer: Has the recordings.
        out: The folder of the answers, one below it for each subject.
        force: Whether what lies there may be written over.
    """

    answerer: Answerer
    out: Path
    force: bool


@dataclass(frozen=True)
class Given:
    """An answer that was given: by which experiment, what to print, and its row of the table."""

    experiment: str
    text: str
    told: Told
    noise: str


def main(options: argparse.Namespace) -> int:
    """Run `infer`; return 0 after printing the answers, or 2 if one of the recordings is refused.

    Raises:
        ConfigError: The configuration or the folder is wrong, or does not have the subject.
        ValueError: The only recording asked for cannot be used, or nothing can answer for its heart.
        OSError: A study that was named has not been run, or the answer cannot be written.
    """
    typed_in = Path.cwd()
    options = at_configuration(options)
    options.cohort, named = recordings_of(options.recordings)
    study = study_with(options)
    experiments = experiments_to_ask(study, options.experiment)
    command = snakemake_options(options.config, options.overlay)
    required = options.experiment is not None
    answerer = Answerer(study, experiments, command, options.from_prior, required)
    out = options.out or typed_in / ANSWERS / study.new_cohort_name
    request = Request(answerer, out, options.force)
    if subject := options.subject or named:
        print(_given(request, subject).text)
        return 0
    return _answer_all(request, options.workers)


def recordings_of(path: Path) -> tuple[Path, str]:
    """Return the folder of recordings that a path names, and the subject, if it is one recording.

    Raises:
        ConfigError: No ``subjects.csv`` says whose recordings they are.
    """
    if path.is_dir():
        return path, ""
    for folder, name in ((path.parent.parent, path.stem), (path.parent, "")):
        if path.exists() and (folder / SUBJECTS).is_file():
            return folder, name
    absent = "there is no such file or folder" if not path.exists() else f"no {SUBJECTS} stands above it"
    raise ConfigError(
        f"{path}: {absent}; a recording lies in FOLDER/swe/, beside FOLDER/{SUBJECTS} and "
        "FOLDER/recording.yaml, which `swesbi template FOLDER` begins"
    )


def _given(request: Request, subject: str) -> Given:
    """Answer one subject by the first that can; an answer that is there, to just this, is kept."""
    from swesbi.study.answer_text import answer_text
    from swesbi.verdict.answers import told_of

    asked, folder = request.answerer.asked(subject), request.out / subject
    if not request.force and (kept := asked.kept_in(folder)) is not None:
        text = (
            f"{subject}: {kept.sentence}\nanswered before, and nothing has changed since: {folder.resolve()}"
        )
        return Given(asked.experiment, text, told_of(kept), asked.recording.noise)
    answer, _ = asked.answer_into(folder, force=request.force)
    files = ", ".join(sorted(path.name for path in folder.iterdir() if path.is_file()))
    lines = [asked.note, answer_text(answer), f"written to {folder.resolve()}: {files}"]
    noise = answer.recording.noise
    return Given(asked.experiment, "\n".join(filter(None, lines)), told_of(answer.verdict), noise)


def _answer_all(request: Request, workers: int) -> int:
    """Answer every subject of the folder, and write the table; no refusal stops it."""
    answerer = request.answerer
    subjects = answerer.subjects
    if not request.force:
        check_table(request.out, subjects)
    given: dict[str, Given] = {}
    refused = dict(answerer.folder.refused)
    usable = [name for name in subjects if name not in refused]
    progress = Progress("answers", len(usable), unit="recording")
    for subject, found in _found(request, usable, workers):
        if isinstance(found, Given):
            given[subject] = found
            print(found.text, flush=True)
        elif is_everyones(found):
            raise found
        else:
            refused[subject] = str(found)
            LOGGER.warning("subject %s is refused", subject)
        progress.step(note=subject)
    table = _write_table(request, given, refused)
    print(f"\n{len(given)} answered, {len(refused)} refused; {table.resolve()}, .xlsx")
    for subject, reason in refused.items():
        print(f"refused: {subject}: {reason}")
    return EXIT_REFUSED if refused else 0


def _found(
    request: Request, subjects: Sequence[str], workers: int
) -> Iterator[tuple[str, Given | Exception]]:
    """Yield the answer to each subject, or why there is none, as they are found."""
    answer = partial(_given_or_refused, request)
    if workers == 1:
        yield from ((subject, answer(subject)) for subject in subjects)
        return
    for subject, found in side_by_side(answer, subjects, workers):
        if isinstance(found, WorkerKilledError):
            found = RuntimeError(f"{found}; type the same again with fewer --workers: other answers are kept")
        yield subject, found


def _given_or_refused(request: Request, subject: str) -> Given | Exception:
    try:
        return _given(request, subject)
    except (ValueError, ArithmeticError, RuntimeError, OSError) as error:
        return error
    except MemoryError as error:
        return RuntimeError(f"the memory ran out {error}".strip())


def check_table(folder: Path, subjects: Sequence[str]) -> None:
    """Refuse to write over a table with other subjects: that of another folder of the same name.

    Raises:
        OtherAnswerError: Names them.
    """
    from swesbi.artefacts.csv import read_csv
    from swesbi.report.answers_table import TABLE

    path = folder / TABLE
    answered = list(read_csv(path)["subject"]) if path.is_file() else []
    others = dict.fromkeys(name for name in answered if name not in subjects)
    if others:
        raise OtherAnswerError(
            f"{path}: has the answers of {', '.join(others)}, who are not in this folder; name another "
            "folder by --out, or write over it by --force"
        )


def _write_table(request: Request, given: Mapping[str, Given], refused: Mapping[str, str]) -> Path:
    """Write the table of the answers, the subjects in the order of the folder, and return its path."""
    from swesbi.report.answers_table import TABLE, Asked, answers_table, write_answers

    answerer = request.answerer
    rows = []
    for subject in answerer.subjects:
        if subject in given:
            one = given[subject]
            rows.append(Asked(subject, one.experiment, one.told, noise=one.noise))
        else:
            rows.append(Asked(subject, ", ".join(answerer.experiments), None, refused[subject]))
    write_answers(answers_table(rows), request.out)
    return request.out / TABLE
