"""Answer subjects outside the pool with the trained network: posterior, certificate, verdict, figures."""

from __future__ import annotations

import argparse
import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from swesbi.answers.answer import Answer
from swesbi.config.read import parsed, snakemake_options
from swesbi.study.answer_text import answer_text
from swesbi.study.answering import (
    EXIT_REFUSED,
    Answerer,
    OtherAnswerError,
    add_answering,
    experiments_to_ask,
    folder_of,
    is_everyones,
    study_with,
)

LOGGER: Final = logging.getLogger("swesbi")
TABLE: Final = {"table": "answers.csv", "workbook": "answers.xlsx"}


@dataclass(frozen=True)
class Request:
    """Who is asked about, and how the answer is to be kept.

    Attributes:
        answerer: Has the recordings.
        out: Folder of the answer, or of the answers of all; None: that of the study.
        force: Whether what lies there may be written over.
    """

    answerer: Answerer
    out: Path | None
    force: bool


@dataclass(frozen=True)
class Given:
    """An answer that was given, and by which experiment."""

    experiment: str
    answer: Answer


def main(arguments: Sequence[str]) -> int:
    """Run `infer`; return 0 after printing the answer, or 2 if one of all subjects is refused.

    Raises:
        ConfigError: The configuration or the cohort is wrong, or does not have the subject.
        ValueError: The recording cannot be used, or no network can answer for the subject's context.
        OSError: The study has not been run, or the answer cannot be written.
    """
    options = parsed(_parser(), arguments)
    study = study_with(options)
    experiments = experiments_to_ask(study, options.experiment)
    answerer = Answerer(study, experiments, snakemake_options(options.config, options.overlay))
    request = Request(answerer, options.out, options.force)
    if options.all:
        return _answer_all(request)
    _answer(request, options.subject, options.out)
    return 0


def _answer(request: Request, subject: str, out: Path | None) -> Given:
    """Answer one subject by the first experiment that can, and print the answer."""
    asked = request.answerer.asked(subject)
    folder = out or folder_of(request.answerer.study, asked.experiment, subject)
    answer = asked.answer_into(folder, force=request.force)
    written = f"written to {folder.resolve()}: {', '.join(sorted(path.name for path in folder.iterdir()))}"
    print("\n".join(filter(None, [asked.note, answer_text(answer), written])))
    return Given(asked.experiment, answer)


def _answer_all(request: Request) -> int:
    """Answer every subject of the cohort, one after the other, and write the table; no refusal stops it."""
    study = request.answerer.study
    if not request.force:
        check_table(_tables(request)["table"], (*study.new_rows, *study.new_refused))
    given: dict[str, Given] = {}
    refused = dict(study.new_refused)
    for subject in study.new_rows:
        try:
            given[subject] = _answer(request, subject, request.out / subject if request.out else None)
        except (ValueError, ArithmeticError, RuntimeError) as error:
            if is_everyones(error):
                raise
            refused[subject] = str(error)
            LOGGER.warning("subject %s is refused", subject)
    paths = _write_table(request, given, refused)
    print(f"\n{len(given)} answered, {len(refused)} refused; {paths['table'].resolve()}, .xlsx")
    for subject, reason in refused.items():
        print(f"refused: {subject}: {reason}")
    return EXIT_REFUSED if refused else 0


def check_table(path: Path, subjects: Sequence[str]) -> None:
    """Refuse to write over a table with other subjects: that of another folder of the same name.

    Raises:
        OtherAnswerError: Names them.
    """
    from swesbi.report.answers_table import read_answers

    answered = list(read_answers(path)["subject"]) if path.is_file() else []
    others = dict.fromkeys(name for name in answered if name not in subjects)
    if others:
        raise OtherAnswerError(
            f"{path}: has the answers of {', '.join(others)}, who are not in this cohort; name another "
            "folder by --out, or write over it by --force"
        )


def _tables(request: Request) -> dict[str, Path]:
    study = request.answerer.study
    folder = request.out or Path(study.config.results) / "new" / study.new_cohort_name
    return {name: folder / file for name, file in TABLE.items()}


def _write_table(
    request: Request, given: Mapping[str, Given], refused: Mapping[str, str]
) -> Mapping[str, Path]:
    """Write ``answers.csv`` and ``answers.xlsx``, the subjects in the order of the cohort."""
    from swesbi.report.answers_table import Asked, answers_table, write_answers
    from swesbi.verdict.answers import told_of

    study = request.answerer.study
    paths = _tables(request)
    rows = []
    for subject in (*study.new_rows, *study.new_refused):
        if subject in given:
            one = given[subject]
            rows.append(Asked(subject, one.experiment, told_of(one.answer.verdict)))
        else:
            asked = ", ".join(request.answerer.experiments)
            rows.append(Asked(subject, asked, None, refused[subject]))
    write_answers(answers_table(rows), paths["table"], paths["workbook"])
    return paths


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="swesbi infer",
        description="Answer subjects who are not in the study's cohort with the network that the study has "
        "trained: exact posterior with its certificate, verdict, figures, in seconds and without training. "
        "A heart unlike those that it was trained on is answered by the network of a population, if one runs "
        "and knows it, and else refused, with the reason. A free-running recording is answered by the "
        "network of a population, or, where none is trained that knows such a heart, from the prior on. The "
        "configuration is that of the study.",
        epilog="Exit code: 0 answered; 2 refused, or one of --all was: the others are answered all the same.",
    )
    parser.add_argument("--cohort", type=Path, required=True, help="folder with the recordings")
    asked = parser.add_mutually_exclusive_group(required=True)
    asked.add_argument("--subject", help="which of its subjects")
    asked.add_argument(
        "--all",
        action="store_true",
        help="all of them, with answers.csv and answers.xlsx in <results>/new/<cohort>/ or in --out",
    )
    add_answering(parser, "<results>/<experiment>/new/<cohort>/<subject>")
    parser.add_argument("--force", action="store_true", help="write over the answer to another recording")
    return parser
