"""The table of answers to subjects outside the study."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from swesbi.artefacts import load
from swesbi.base import Settings
from swesbi.config.refusals import why_not_interpreted
from swesbi.posterior.truncated import POSTERIOR
from swesbi.show.answers_table import Asked, answers_table, write_answers
from swesbi.study.stages.origin import Origin
from swesbi.verdict.answers import NOT_INTERPRETABLE, REFUSED, read_answer

LOGGER = logging.getLogger("swesbi")


class AskedSubject(Settings):
    """One subject asked of one experiment, and why it is refused; an empty reason: it is answered.

    ``waves`` are the natural waves of a recording that has nothing else, which may not be interpreted.
    """

    subject: str
    experiment: str
    refused: str
    waves: tuple[str, ...] = ()


class NewAnswersStageSettings(Settings):
    """Who was asked, in the order of the rows; those that are answered have files in the same order."""

    asked: tuple[AskedSubject, ...]


def new_answers(
    *,
    posteriors: Sequence[Path],
    supports: Sequence[Path],
    outcomes: Sequence[Path],
    table: Path,
    workbook: Path,
    settings: NewAnswersStageSettings,
    origin: Origin,
) -> None:
    """Write the table of all subjects asked, a row each; a refused one has its reason.

    Args:
        posteriors: Exact posteriors of those that are answered, in the order of the settings.
        supports: Their verdicts, in the same order.
        outcomes: Which natural waves are interpreted, a file for each row that has nothing else.
        table: Output, ``answers.csv``.
        workbook: Output, ``answers.xlsx``.

    Raises:
        ArtefactError: A posterior or a verdict is no such file, or an output cannot be written.
    """
    files, decided = iter(zip(posteriors, supports, strict=True)), iter(outcomes)
    rows = []
    for one in settings.asked:
        waves = "" if one.refused or not one.waves else why_not_interpreted(next(decided), one.waves)
        if reason := one.refused or waves:
            status = NOT_INTERPRETABLE if waves else REFUSED
            rows.append(Asked(one.subject, one.experiment, None, float("nan"), reason, status))
        else:
            rows.append(answered(one.subject, one.experiment, *next(files)))
    write_answers(answers_table(rows), table, workbook)
    refused = sum(row.answer is None for row in rows)
    LOGGER.info("%d answers, %d refused: %s", len(rows) - refused, refused, table)


def answered(subject: str, experiment: str, posterior: Path, support: Path) -> Asked:
    """Return the row of one answer, read from its files.

    Raises:
        ArtefactError: A file is not what its name says.
    """
    mass = float(load(posterior, POSTERIOR)[0]["interval_mass"])
    return Asked(subject, experiment, read_answer(posterior, support), mass)
