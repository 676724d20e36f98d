"""The answers to all subjects asked, a row each, with what each column means."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pandas as pd

from swesbi import __version__
from swesbi.artefacts.csv import write_csv
from swesbi.report.workbook import write_workbook
from swesbi.verdict.answer_lines import ANSWER_LINES, IN_WORDS
from swesbi.verdict.summary import LIMITS, REFUSED, AnswerSummary, answer_columns
from swesbi.verdict.verdict import STATUSES

TABLE: Final = "answers.csv"
COLUMNS: Final = "answers_columns.csv"
"""What the columns of the table mean."""
WORKBOOK: Final = "answers.xlsx"
LIMIT_NAMES: Final = {"median": "posterior median", "low": "lower end", "high": "upper end"}
FIRST: Final = {
    "subject": "name in subjects.csv",
    "experiment": "its prior was used, and its network where a study has trained one",
    "status": f"verdict: {', '.join(STATUSES)}; {REFUSED}: there is no posterior",
    "reason": "tests that contradict the model, or why there is no posterior",
    "noise": "from what its standard errors are estimated",
    "notes": "what of the recording is left out, or odd",
    "interval_mass": "probability that lies between the limits of each interval; 1",
}
LAST: Final = {
    "k_hat": "Pareto shape of the importance weights, the smaller the more reliable; 1",
    "efficiency": "effective share of the weighted draws; 1",
    "sampler": "what gave the draws: importance or mcmc",
    "swesbi_version": "version of the package that wrote the row",
    "columns_version": "version of these columns: it rises where one is renamed or goes",
}
COLUMNS_VERSION: Final = 1


@dataclass(frozen=True)
class AnswerRow:
    """One subject and one experiment: the answer, or why there is none.

    Attributes:
        subject: Name.
        experiment: Which network was asked.
        answer: What it answered; None where it is refused.
        refused: The reason; empty where there is an answer.
        noise: From what its standard errors are estimated, in words.
        notes: What of the recording is left out, or odd, in words.
    """

    subject: str
    experiment: str
    answer: AnswerSummary | None
    refused: str = ""
    noise: str = ""
    notes: str = ""


def explanations() -> dict[str, str]:
    """Return what each column of the table means, with its unit, by its name."""
    limits = {
        f"{line.parameter.name}_{limit}": f"{LIMIT_NAMES[limit]} of {line.parameter.meaning} "
        f"{line.parameter.text}"
        f"{'' if limit == 'median' else ', credible interval'}; {line.parameter.unit}; "
        f"{IN_WORDS[line.trust]}: {line.condition}"
        for line in ANSWER_LINES
        for limit in LIMITS
    }
    return FIRST | limits | LAST


def answers_table(asked: Sequence[AnswerRow]) -> pd.DataFrame:
    """Return a row for each subject asked, in the columns of :func:`explanations`."""
    return pd.DataFrame([_row(one) for one in asked], columns=list(explanations()))


def _row(asked: AnswerRow) -> Mapping[str, object]:
    row: dict[str, object] = {"subject": asked.subject, "experiment": asked.experiment}
    row |= {"swesbi_version": __version__, "columns_version": COLUMNS_VERSION}
    if asked.answer is None:
        return row | {"status": REFUSED, "reason": " ".join(asked.refused.split())}
    answer = asked.answer
    values = [*answer.limits.ravel().tolist(), answer.k_hat, answer.efficiency, answer.sampler]
    row |= {name: getattr(answer, name) for name in ("status", "reason", "interval_mass")}
    row |= {"noise": asked.noise, "notes": asked.notes}
    return row | dict(zip(answer_columns(), values, strict=True))


def write_answers(table: pd.DataFrame, folder: Path) -> None:
    """Write the table as CSV and as a workbook; what its columns mean is a file beside it and a sheet.

    Raises:
        ArtefactError: A file cannot be written.
    """
    said = explanations()
    meanings = pd.DataFrame({"column": list(said), "meaning": list(said.values())})
    write_csv(folder / TABLE, table)
    write_csv(folder / COLUMNS, meanings)
    write_workbook(folder / WORKBOOK, {"answers": table, "columns": meanings})
