"""Answers in words: one in the lines of a terminal, all in a table with what each column means."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Final

import pandas as pd

from swesbi import __version__
from swesbi.answers.answer import Answer
from swesbi.artefacts.csv import write_csv
from swesbi.draws import median_and_interval
from swesbi.parameters import PHI_NAMES, ParameterPrior
from swesbi.posterior.result import ExactPosterior
from swesbi.report.table import write_workbook
from swesbi.verdict.answer_lines import ANSWER_LINES, IN_WORDS
from swesbi.verdict.summary import (
    LIMITS,
    REFUSED,
    AnswerSummary,
    sampler_in_words,
    weights_in_words,
)
from swesbi.verdict.verdict import STATUSES

TABLE: Final = "answers.csv"
COLUMNS: Final = "answers_columns.csv"
"""What the columns of the table mean."""
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
WIDTH: Final = 24
"""Of the names in the lines of an answer."""


@dataclass(frozen=True)
class AnswerRow:
    """One subject and one experiment: the answer, or why it is refused; noise and notes in words."""

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
    row: dict[str, object] = {
        "subject": asked.subject,
        "experiment": asked.experiment,
        "swesbi_version": __version__,
        "columns_version": COLUMNS_VERSION,
    }
    if asked.answer is None:
        return row | {"status": REFUSED, "reason": " ".join(asked.refused.split())}
    said = {"noise": asked.noise, "notes": asked.notes, "interval_mass": asked.answer.interval_mass}
    return row | said | asked.answer.row


def write_answers(table: pd.DataFrame, folder: Path) -> None:
    """Write the table as CSV and as a workbook; what its columns mean is a file beside it and a sheet."""
    meanings = pd.DataFrame(list(explanations().items()), columns=["column", "meaning"])
    write_csv(folder / TABLE, table)
    write_csv(folder / COLUMNS, meanings)
    write_workbook(folder / "answers.xlsx", {"answers": table, "columns": meanings})


def answer_text(answer: Answer) -> str:
    """Return verdict, intervals and the check of the sampling in lines, what can best be relied on first."""
    exact, verdict = answer.posterior, answer.verdict
    prior = answer.recording.model.settings.prior
    bounds = dict(zip(PHI_NAMES, prior.parameters, strict=False))
    lines = [f"{answer.recording.observation.subject}: {verdict.sentence}"]
    lines += [f"  {reason}" for reason in verdict.reasons]
    mass = f"{100.0 * exact.interval_mass:.0f} % interval"
    lines.append(f"{'':{WIDTH}}{'median':>8}  {mass:<18}  prior's bounds")
    for trust, group in groupby(ANSWER_LINES, lambda line: line.trust):
        where = " (each condition is in verdict.json)" if trust == "conditional" else ""
        lines.append(f"{IN_WORDS[trust]}{where}:")
        for line in group:
            name = line.parameter.name
            said, own = verdict.answer[name], bounds.get(name)
            lines.append(_line(name, float(said["median"]), float(said["low"]), float(said["high"]), own))
    if (both := answer.with_pressures) is not None:
        taken = answer.recording.observation.clinical
        by = "MCMC" if both.by_mcmc else f"importance weights, efficiency {100.0 * both.efficiency:.0f} %"
        lines.append(
            f"with cuff pressures {taken.sbp_mmhg:g} / {taken.dbp_mmhg:g} mmHg (by {by}{_doubt(both)}); "
            "the verdict is that of the speeds:"
        )
        ends = median_and_interval(both.phi, both.interval_mass)
        lines += [
            _line(name, median, low, high, bounds.get(name))
            for name, low, median, high in zip(PHI_NAMES, *ends, strict=False)
        ]
    lines.append(f"errors: {answer.recording.noise}")
    lines.append(
        f"sampling check {'passed' if exact.converged else 'FAILED'}: draws by {sampler_in_words(verdict)}; "
        f"weights: {weights_in_words(verdict)} "
        f"(k-hat at most {exact.k_hat_limit:.2f}){_doubt(exact)}"
    )
    return "\n".join(lines)


def _doubt(exact: ExactPosterior) -> str:
    return "" if exact.converged else "; NOT CONVERGED, do not use"


def _line(name: str, median: float, low: float, high: float, prior: ParameterPrior | None) -> str:
    interval = f"[{low:.4g}, {high:.4g}]"
    bounds = "" if prior is None else f"  {prior.low:g} to {prior.high:g}"
    return f"{name:{WIDTH}}{median:8.4g}  {interval:<18}{bounds}".rstrip()
