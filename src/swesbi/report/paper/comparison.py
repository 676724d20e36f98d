"""The paper's numbers beside this study's, one row each, with a reading of the difference made by rule."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np
import pandas as pd

from swesbi.artefacts.csv import Table
from swesbi.report.paper import measures
from swesbi.report.paper.values import (
    DESIGNED,
    FOUND,
    Findings,
    Measure,
    NoValueError,
    PaperNumber,
    StudyValue,
    differ,
    shown,
)

PAPER_RECORDINGS: Final = 400
"""The recordings behind the coverages that the paper prints (Sec. 3)."""
EQUAL: Final = "equal to the digits printed"
ONE_PHASE: Final = 0.05
"""A coverage counts phases of a cycle, of which the paper has 20."""
COLUMNS: Final = ("quantity", "paper", "this_study", "note", "origin")
STATEMENT_COLUMNS: Final = ("statement", "paper", "this_study", "agrees", "origin")
COMPARISON: Final = Table(columns=COLUMNS, texts=COLUMNS)
ComparisonTable = Annotated[pd.DataFrame, COMPARISON]
"""``paper_comparison.csv``, as it was written."""
STATEMENTS: Final = Table(columns=STATEMENT_COLUMNS, texts=STATEMENT_COLUMNS)
StatementsTable = Annotated[pd.DataFrame, STATEMENTS]
"""``statements.csv``, as it was written."""
SHIPPED: Final = "virtual volunteers"
"""The title of the cohort that comes with the study."""
MAIN: Final = "experiment."
"""Beginning of the paths of settings that are the main experiment's."""
MEASURES: Final[Mapping[str, Measure]] = {
    name: function
    for name, function in vars(measures).items()
    if getattr(function, "__module__", "") == measures.__name__ and not name.startswith("_")
}
"""The public functions of the module, by name."""


@dataclass(frozen=True)
class Difference:
    """How this study's value differs from the paper's: whether both agree, by the rule, and in words."""

    agrees: bool
    words: str


Reading = Callable[[PaperNumber, StudyValue, str], Difference]


def read_difference(paper: PaperNumber, measured: StudyValue, cohort_title: str) -> Difference:
    """Return the reading of one row, its remark included."""
    reading = READINGS[paper.row.reading](paper, measured, cohort_title)
    return replace(reading, words=f"{reading.words}. {paper.row.remark}") if paper.row.remark else reading


def origin(paper: PaperNumber, study: Findings) -> str:
    """Return "found", or "designed" with the place of the choice behind this study's value or its agreement.

    A number read from the configuration is designed by its setting; of others the data file says where. What
    the maker of the shipped volunteers chose designs nothing of other subjects.
    """
    path, designed = paper.row.path, paper.row.designed
    if "volunteers" in designed and study.cohort_title != SHIPPED:
        return FOUND
    if designed or not path:
        return f"{DESIGNED} ({designed})" if designed else FOUND
    key = path.replace(MAIN, f"experiment {study.main}, ") if path.startswith(MAIN) else path
    return f"{DESIGNED} (config.yaml: {key})"


def _if_equal(equal: str, otherwise: str) -> Reading:
    """Return the reading of a number that is the paper's or is not, by what it says of either.

    It may have the fields ``cohort``, what the subjects are, and ``difference``.
    """

    def read(paper: PaperNumber, measured: StudyValue, cohort_title: str) -> Difference:
        same = abs(measured.value - paper.value) <= 1e-9 * max(abs(paper.value), 1e-12)
        words = equal if same else otherwise
        return Difference(same, words.format(cohort=cohort_title, difference=_difference(paper, measured)))

    return read


def _spread(paper: PaperNumber, measured: StudyValue, cohort_title: str) -> Difference:
    """Say whether the mean lies within the paper's mean ± sd, else by how much it does not."""
    if abs(measured.value - paper.value) <= paper.sd:
        return Difference(True, "within the paper's spread")
    return Difference(
        False,
        f"outside the paper's spread: {_difference(paper, measured)}; {cohort_title}, "
        "other subjects than the paper's",
    )


def _case(paper: PaperNumber, measured: StudyValue, cohort_title: str) -> Difference:
    """Compare a number of one case, who is another person than the paper's."""
    above = paper.printed.startswith(">") and measured.value > paper.value
    difference = (
        f"above {shown(paper.value, paper.row.digits)} too" if above else _difference(paper, measured)
    )
    same = above or difference == EQUAL
    return Difference(same, f"{difference}; another subject than the paper's")


def _phase(paper: PaperNumber, measured: StudyValue, cohort_title: str) -> Difference:
    """Say whether a coverage lies within one phase of the paper's; ">0.99" begins at 0.99."""
    off = measured.value - paper.value
    near = off >= -ONE_PHASE and (off <= ONE_PHASE or paper.printed.startswith(">"))
    return Difference(near, _case(paper, measured, cohort_title).words)


def _side(paper: PaperNumber, measured: StudyValue, cohort_title: str) -> Difference:
    """Say whether both values lie on one side of a bound."""
    bound = float(paper.row.of["bound"])
    same = (measured.value > bound) == (paper.value > bound)
    where = "above" if measured.value > bound else "not above"
    return Difference(same, f"{where} {shown(bound, 0)}, {'as' if same else 'unlike'} in the paper")


def _all_inside(paper: PaperNumber, measured: StudyValue, cohort_title: str) -> Difference:
    of = f"{shown(measured.value, 0)} of {measured.n} supported cases"
    if measured.value == measured.n == paper.value:
        return Difference(True, f"holds in {of}, as in the paper")
    return Difference(False, f"holds in {of}, in the paper in all {shown(paper.value, 0)}")


def _binomial(paper: PaperNumber, measured: StudyValue, cohort_title: str) -> Difference:
    """Say whether two frequencies differ beyond the 95 % interval of their difference."""
    if not differ(paper.value / 100.0, PAPER_RECORDINGS, measured.value / 100.0, measured.n):
        return Difference(True, "no difference beyond binomial error")
    return Difference(False, f"{_difference(paper, measured)} percentage points, beyond binomial error")


def _words(paper: PaperNumber, measured: StudyValue, cohort_title: str) -> Difference:
    """Compare what stands before the details of this study's value."""
    said = measured.text.split(" (")[0].split(":")[0]
    if said == paper.printed:
        return Difference(True, "as in the paper")
    partly = said.startswith("in ")
    return Difference(False, "holds in part of the subjects" if partly else "differs from the paper")


def _difference(paper: PaperNumber, measured: StudyValue) -> str:
    """Say which value is higher, by the decimals that are shown."""
    digits = paper.row.digits
    difference = round(measured.value, digits) - round(paper.value, digits)
    if shown(difference, digits) == shown(0.0, digits):
        return EQUAL
    return f"{'higher' if difference > 0.0 else 'lower'} by {shown(abs(difference), digits)}"


READINGS: Final[Mapping[str, Reading]] = {
    "configured": _if_equal("same by configuration", "configured otherwise here"),
    "identity": _if_equal("same definition", "another definition here"),
    "protocol": _if_equal("same protocol ({cohort})", "another protocol ({cohort})"),
    "count": _if_equal("the same number", "{difference}"),
    "spread": _spread,
    "case": _case,
    "phase": _phase,
    "side": _side,
    "all_inside": _all_inside,
    "binomial": _binomial,
    "words": _words,
}


def comparison_table(paper: Sequence[PaperNumber], study: Findings) -> pd.DataFrame:
    """Return the columns ``COLUMNS``, all text, every cell filled; rows in the order of ``paper``."""
    rows = (
        (printed.quantity, printed.printed, measured.text, difference.words, origin(printed, study))
        for printed, measured, difference in _compared(paper, study)
    )
    return pd.DataFrame(rows, columns=list(COLUMNS))


def statements_table(paper: Sequence[PaperNumber], study: Findings) -> pd.DataFrame:
    """Return the columns ``STATEMENT_COLUMNS``: a row for each of the paper's statements on its results.

    A statement is one or several of the paper's numbers. It agrees where each of them agrees, and is
    designed where one of them is.
    """
    scored = [number for number in paper if number.row.statement]
    compared = pd.DataFrame(
        [
            {
                "statement": printed.row.statement,
                "paper": _brief(printed, printed.printed),
                "this_study": _brief(printed, measured.text),
                "agrees": difference.agrees,
                "designed": origin(printed, study) != FOUND,
            }
            for printed, measured, difference in _compared(scored, study)
        ]
    )
    table = compared.groupby("statement", sort=False).agg(
        paper=("paper", "; ".join),
        this_study=("this_study", "; ".join),
        agrees=("agrees", "all"),
        designed=("designed", "any"),
    )
    table["origin"] = np.where(table.pop("designed"), DESIGNED, FOUND)
    table["agrees"] = np.where(table["agrees"], "yes", "no")
    return table.reset_index()[list(STATEMENT_COLUMNS)]


def score_in_words(statements: pd.DataFrame) -> str:
    """Return how many of the paper's statements agree, and how many of these by design."""
    agrees = statements["agrees"] == "yes"
    designed = agrees & (statements["origin"] == DESIGNED)
    return (
        f"{agrees.sum()} of the paper's {len(statements)} statements agree, "
        f"{designed.sum()} of them by design"
    )


def _compared(
    paper: Sequence[PaperNumber], study: Findings
) -> Iterator[tuple[PaperNumber, StudyValue, Difference]]:
    for printed in paper:
        try:
            measured = MEASURES[printed.row.measure](study, printed)
        except NoValueError as reason:
            yield printed, StudyValue(f"none: {reason}"), Difference(False, f"no value to compare: {reason}")
        else:
            yield printed, measured, read_difference(printed, measured, study.cohort_title)


def _brief(paper: PaperNumber, text: str) -> str:
    """Return a cell with its case, without details: what stands in brackets, and behind a colon."""
    return f"{paper.case} {text.split(' (')[0].split(' [')[0].split(':')[0]}".strip()
