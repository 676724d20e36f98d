"""The paper's statements in one table: what it says, what came out here and how it is read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import pandas as pd

from swesbi.report.results import records
from swesbi.report.table import Table, markdown
from swesbi.report.tables.experiments import marked
from tools.docs.results import ReproductionResults

CASE: Final = ", case "


@dataclass(frozen=True)
class Statement:
    """One statement of the paper.

    Attributes:
        text: What the table calls it.
        quantity: How its rows of ``paper_comparison.csv`` begin; several rows are of several cases.
        by: What it is taken to mean here, where the text of the paper leaves that open.
    """

    text: str
    quantity: str
    by: str = ""


BEST: Final = "weights of the best epoch"
STATEMENTS: Final = (
    Statement("subjects with prior support", "subjects that pass"),
    Statement("RMSE of the prior's median (kPa)", "RMSE of the prior predictive median, mean"),
    Statement("RMSE of the posterior's median (kPa)", "RMSE of the posterior predictive median, mean"),
    Statement("RMSE reduction (%)", "RMSE reduction, mean"),
    Statement(
        "coverage of the observed curve",
        "coverage of the 90 % predictive interval, as the band",
        "band of noiseless curves",
    ),
    Statement(
        "the same",
        "coverage of the 90 % predictive interval, with the noise",
        "interval with the noise of Eq. 5",
    ),
    Statement("cases with all noisy features inside", "noise-modelled features inside"),
    Statement("cases where SBI is below CMA-ES", "supported cases where the SBI median", "equal weights"),
    Statement("r(k_0, k_ATP)", "r(k_0, k_ATP)"),
    Statement("recovery of k_0 (%)", "coverage of k_0", BEST),
    Statement("recovery of k_ATP (%)", "coverage of k_ATP", BEST),
    Statement("recovery of k_SR (%)", "coverage of k_SR", BEST),
    Statement("scalars alone predict worse", "scalar-only summaries"),
    Statement("a wider prior shifts k_ATP", "wider priors shift"),
    Statement("a wider prior degrades coverage", "wider timing bounds"),
)


def statements_part(results: ReproductionResults) -> str:
    """Show the paper's statements beside this study's, from the comparison of every number."""
    rows = [_cells(statement, results.comparison) for statement in STATEMENTS]
    heads = ["Statement", "Paper", "Here", "Reading", "Designed or found"]
    return markdown(Table("", pd.DataFrame(rows, columns=heads)))


def _cells(statement: Statement, comparison: pd.DataFrame) -> tuple[str, ...]:
    chosen = comparison[comparison["quantity"].str.startswith(statement.quantity)]
    if chosen.empty:
        raise ValueError(f"paper_comparison.csv has no number that begins {statement.quantity!r}")
    found = records(chosen)
    cases = [str(row["quantity"]).partition(CASE)[2][:1] for row in found]
    paper, here = (
        ", ".join(f"{case} {_brief(row[name])}".strip() for case, row in zip(cases, found, strict=True))
        for name in ("paper", "this_study")
    )
    (origin,) = {_brief(marked(str(row["origin"]))) for row in found}
    notes = [statement.by] if len(found) > 1 else [statement.by, _rule(str(found[0]["note"]))]
    return statement.text, paper, here, "; ".join(filter(None, notes)), origin


def _rule(note: str) -> str:
    """Return what the rule says of the difference, without the remark behind it."""
    return note.partition(". ")[0].partition("; ")[0]


def _brief(text: object) -> str:
    """Return a cell without its details: what stands in brackets, and behind a colon."""
    short = str(text).split(" (")[0].split(" [")[0].split(":")[0]
    return short.replace("-", "−") if short[:1] == "-" else short
