"""The paper's statements beside this study's, and whether both agree, by ``paper_comparison.csv``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import pandas as pd

from swesbi.config.study import Study
from swesbi.report.paper.comparison import DESIGNED, FOUND
from swesbi.report.tables.experiments import read_comparison

CASE: Final = ", case "
BEST: Final = "weights of the best epoch"
STATEMENTS: Final = (
    ("subjects with prior support", "subjects that pass", ""),
    ("RMSE of the prior's median (kPa)", "RMSE of the prior predictive median, mean", ""),
    ("RMSE of the posterior's median (kPa)", "RMSE of the posterior predictive median, mean", ""),
    ("RMSE reduction (%)", "RMSE reduction, mean", ""),
    (
        "coverage of the observed curve",
        "coverage of the 90 % predictive interval, as the band",
        "band of noiseless curves",
    ),
    (
        "coverage of the observed curve, with noise",
        "coverage of the 90 % predictive interval, with the noise",
        "interval with the noise of Eq. 5",
    ),
    ("cases with all noisy features inside", "noise-modelled features inside", ""),
    ("cases where SBI is below CMA-ES", "supported cases where the SBI median", "equal weights"),
    ("r(k_0, k_ATP)", "r(k_0, k_ATP)", ""),
    ("recovery of k_0 (%)", "coverage of k_0", BEST),
    ("recovery of k_ATP (%)", "coverage of k_ATP", BEST),
    ("recovery of k_SR (%)", "coverage of k_SR", BEST),
    ("scalars alone predict worse", "scalar-only summaries", ""),
    ("a wider prior shifts k_ATP", "wider priors shift", ""),
    ("a wider prior degrades coverage", "wider timing bounds", ""),
)
"""What the table calls a statement, how its rows of the comparison begin (several are of several cases), and
what it is taken to mean where the paper's text leaves that open."""
AGREES: Final = "agrees"
IN_PART: Final = "in part"
DIFFERS: Final = "does not"
SAME: Final = (
    "the same number",
    "within the paper's spread",
    "no difference",
    "as in the paper",
    "holds in every",
)
PARTLY: Final = "holds in "
NOWHERE: Final = "holds in 0 of"
LOWER: Final = "lower by"
NO_VALUE: Final = "no value to compare"


def statements_table(study: Study) -> pd.DataFrame:
    """Return the paper's statements beside this study's.

    Raises:
        ArtefactError: The study is not finished.
    """
    return of_comparison(read_comparison(Path(study.config.results) / "tables" / "paper_comparison.csv"))


def of_comparison(comparison: pd.DataFrame) -> pd.DataFrame:
    """Return the statements by the rows of the comparison.

    Raises:
        ValueError: The comparison has no row for a statement.
    """
    rows = [_row(text, begin, taken, comparison) for text, begin, taken in STATEMENTS]
    return pd.DataFrame(rows, columns=["statement", "paper", "here", "agreement", "reading", "origin"])


def _row(text: str, begin: str, taken: str, comparison: pd.DataFrame) -> list[str]:
    rows = comparison[comparison["quantity"].str.startswith(begin)]
    if rows.empty:
        raise ValueError(f"paper_comparison.csv has no number that begins {begin!r}")
    notes = [str(note).partition(". ")[0].partition("; ")[0] for note in rows["note"]]
    cases = [str(name).partition(CASE)[2][:1] for name in rows["quantity"]]
    paper, here = (
        ", ".join(f"{case} {_brief(str(cell))}".strip() for case, cell in zip(cases, rows[name], strict=True))
        for name in ("paper", "this_study")
    )
    reading = "; ".join(filter(None, (taken, "" if len(rows) > 1 else notes[0])))
    origin = DESIGNED if rows["origin"].str.startswith(DESIGNED).any() else FOUND
    return [text, paper, here, agreement(notes), reading, origin]


def agreement(notes: Sequence[str]) -> str:
    """Return whether a statement agrees, by the rule's reading of each of its cases.

    Several cases are coverages; one agrees where it is not lower than the paper's. Cases that are not
    prior-supported have none, and are left out.
    """
    if len(notes) > 1:
        lower = [note.startswith(LOWER) for note in notes if not note.startswith(NO_VALUE)]
        return DIFFERS if all(lower) else IN_PART if any(lower) else AGREES
    (note,) = notes
    if note.startswith(SAME):
        return AGREES
    return IN_PART if note.startswith(PARTLY) and not note.startswith(NOWHERE) else DIFFERS


def _brief(text: str) -> str:
    """Return a cell without its details: what stands in brackets, and behind a colon."""
    short = text.split(" (")[0].split(" [")[0].split(":")[0]
    return short.replace("-", "−") if short[:1] == "-" else short
