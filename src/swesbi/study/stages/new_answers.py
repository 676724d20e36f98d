"""The table of answers to subjects outside the study."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from swesbi.artefacts import load
from swesbi.base.settings import Settings
from swesbi.posterior.truncated import POSTERIOR
from swesbi.show.answers_table import Asked, answers_table, write_answers
from swesbi.study.stages.origin import Origin
from swesbi.verdict.answers import read_answer

LOGGER = logging.getLogger("swesbi")


class AskedSubject(Settings):
    """One subject asked of one experiment, and why it is refused; an empty reason: it is answered."""

    subject: str
    experiment: str
    refused: str


class NewAnswersStageSettings(Settings):
    """Who was asked, in the order of the rows; those that are answered have files in the same order."""

    asked: tuple[AskedSubject, ...]


def new_answers(
    *,
    posteriors: Sequence[Path],
    supports: Sequence[Path],
    table: Path,
    workbook: Path,
    settings: NewAnswersStageSettings,
    origin: Origin,
) -> None:
    """Write the table of all subjects asked, a row each; a refused one has its reason.

    Args:
        posteriors: Exact posteriors of those that are answered, in the order of the settings.
        supports: Their verdicts, in the same order.
        table: Output, ``answers.csv``.
        workbook: Output, ``answers.xlsx``.

    Raises:
        ArtefactError: A posterior or a verdict is no such file, or an output cannot be written.
    """
    files = iter(zip(posteriors, supports, strict=True))
    rows = [
        unanswered(one) if one.refused else answered(one.subject, one.experiment, *next(files))
        for one in settings.asked
    ]
    write_answers(answers_table(rows), table, workbook)
    refused = sum(bool(one.refused) for one in settings.asked)
    LOGGER.info("%d answers, %d refused: %s", len(rows) - refused, refused, table)


def unanswered(one: AskedSubject) -> Asked:
    """Return the row of a subject who has no answer."""
    return Asked(one.subject, one.experiment, None, float("nan"), one.refused)


def answered(subject: str, experiment: str, posterior: Path, support: Path) -> Asked:
    """Return the row of one answer, read from its files.

    Raises:
        ArtefactError: A file is not what its name says.
    """
    mass = float(load(posterior, POSTERIOR)[0]["interval_mass"])
    return Asked(subject, experiment, read_answer(posterior, support), mass)
