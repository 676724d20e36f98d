"""The answers to all subjects asked, a row each: as CSV and as a workbook, with what each column means."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Final

import pandas as pd

from swesbi.artefacts import atomic_path
from swesbi.report.csv import EIGHT_DIGITS
from swesbi.report.workbook import Sheet, write_workbook
from swesbi.verdict.answers import LIMITS, REFUSED, Answer, answer_columns
from swesbi.verdict.trust import ANSWER, IN_WORDS

COMMENT: Final = "# "
SAID: Final = {"median": "posterior median", "low": "lower end", "high": "upper end"}
FIRST: Final = {
    "subject": "name in subjects.csv",
    "experiment": "whose network answered: of the study's cohort, or of a population",
    "status": "verdict: not contradicted, strained or contradicted, of a free-running recording no "
    "verdict or uninformative; refused: there is no answer",
    "reason": "tests that speak against the model, or why there is no answer",
    "interval_mass": "probability that lies between the limits of each interval; 1",
}
LAST: Final = {
    "k_hat": "Pareto shape of the importance weights, the smaller the more reliable; 1",
    "efficiency": "effective share of the weighted draws; 1",
    "sampler": "what gave the draws: importance or mcmc",
}


@dataclass(frozen=True)
class Asked:
    """One subject asked of one experiment: the answer, or why there is none.

    Attributes:
        subject: Name.
        experiment: Which network was asked.
        answer: What it answered; None where it is refused.
        refused: The reason; empty where there is an answer.
    """

    subject: str
    experiment: str
    answer: Answer | None
    refused: str = ""


def explanations() -> dict[str, str]:
    """Return what each column of the table means, with its unit, by its name."""
    limits = {
        f"{line.parameter.name}_{limit}": f"{SAID[limit]} of {line.parameter.meaning} {line.parameter.text}"
        f"{'' if limit == 'median' else ', credible interval'}; {line.parameter.unit}; "
        f"{IN_WORDS[line.trust]}: {line.condition}"
        for line in ANSWER
        for limit in LIMITS
    }
    return FIRST | limits | LAST


def answers_table(asked: Sequence[Asked]) -> pd.DataFrame:
    """Return a row for each subject asked, in the columns of :func:`explanations`."""
    return pd.DataFrame([_row(one) for one in asked], columns=list(explanations()))


def _row(asked: Asked) -> Mapping[str, object]:
    row: dict[str, object] = {"subject": asked.subject, "experiment": asked.experiment}
    if asked.answer is None:
        return row | {"status": REFUSED, "reason": " ".join(asked.refused.split())}
    answer = asked.answer
    values = [*answer.limits.ravel().tolist(), answer.k_hat, answer.efficiency, answer.sampler]
    said = {"status": answer.status, "reason": answer.reason, "interval_mass": answer.interval_mass}
    return row | said | dict(zip(answer_columns(), values, strict=True))


def write_answers(table: pd.DataFrame, csv: Path, workbook: Path) -> None:
    """Write the table: as CSV below lines from ``#`` on that explain the columns, and as a workbook.

    Raises:
        ArtefactError: A file cannot be written.
    """
    said = explanations()
    width = max(map(len, said)) + 2
    lines = [f"{COMMENT}{name:<{width}}{meaning}\n" for name, meaning in said.items()]
    text = StringIO()
    table.to_csv(text, index=False, float_format=EIGHT_DIGITS, lineterminator="\n")
    with atomic_path(csv) as temporary:
        temporary.write_text("".join(lines) + text.getvalue(), encoding="utf-8")
    meanings = pd.DataFrame({"column": list(said), "meaning": list(said.values())})
    write_workbook(workbook, [Sheet("answers", table), Sheet("columns", meanings)])


def read_answers(path: Path) -> pd.DataFrame:
    """Read ``answers.csv``."""
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    first = next(row for row, line in enumerate(lines) if not line.startswith(COMMENT))
    return pd.read_csv(StringIO("".join(lines[first:])), converters={"subject": str})
