"""The paper's numbers beside this study's, one row each, with a reading of the difference made by rule."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Final

import pandas as pd

from swesbi.report.paper import design, measures
from swesbi.report.paper.measured import Measure, Measured, StudyResults, differ, shown
from swesbi.report.paper.values import PaperNumber

PAPER_RECORDINGS: Final = 400
"""The recordings behind the coverages that the paper prints (Sec. 3)."""

Reading = Callable[[PaperNumber, Measured, str], str]
COLUMNS: Final = ("quantity", "paper", "this_study", "note", "origin")
FOUND: Final = "found"
DESIGNED: Final = "designed"
MAIN: Final = "experiment."
"""Beginning of the paths of settings that are the main experiment's."""
MEASURES: Final[Mapping[str, Measure]] = {
    name: function
    for module in (design, measures)
    for name, function in vars(module).items()
    if getattr(function, "__module__", "") == module.__name__ and not name.startswith("_")
}
"""The public functions of the two modules, by name."""


class ReadingError(ValueError):
    """A row of the paper's numbers that no rule can read."""


def read_difference(paper: PaperNumber, measured: Measured, cohort_title: str) -> str:
    """Return the reading of one row, its remark included where there is a value.

    Args:
        paper: What the paper prints.
        measured: This study's value, or why there is none.
        cohort_title: What the subjects are ("virtual volunteers").

    Raises:
        ReadingError: The row names no rule.
    """
    if paper.row.reading not in READINGS:
        known = ", ".join(READINGS)
        raise ReadingError(f"{paper.quantity}: {paper.row.reading!r} is no reading; known: {known}")
    rule = READINGS[paper.row.reading]
    if measured.missing:
        return f"no value to compare: {measured.missing}"
    reading = rule(paper, measured, cohort_title)
    return f"{reading}. {paper.row.remark}" if paper.row.remark else reading


def origin(paper: PaperNumber, main: str) -> str:
    """Return "found", or "designed" with the place of the choice behind this study's value or its agreement.

    A number read from the configuration is designed by its setting; of others the data file says where.

    Args:
        paper: What the paper prints.
        main: The experiment that stands for the paper's.
    """
    path = str(paper.row.of.get("path", ""))
    if paper.row.designed or not path:
        return f"{DESIGNED} ({paper.row.designed})" if paper.row.designed else FOUND
    within = path.removeprefix(MAIN)
    owner = f"experiment {main}, " if within != path else ""
    return f"{DESIGNED} (config.yaml: {owner}{within})"


def _configured(paper: PaperNumber, measured: Measured, cohort_title: str) -> str:
    return "same by configuration" if _same(paper, measured) else "configured otherwise here"


def _identity(paper: PaperNumber, measured: Measured, cohort_title: str) -> str:
    return "same definition" if _same(paper, measured) else "another definition here"


def _protocol(paper: PaperNumber, measured: Measured, cohort_title: str) -> str:
    return f"{'same' if _same(paper, measured) else 'another'} protocol ({cohort_title})"


def _count(paper: PaperNumber, measured: Measured, cohort_title: str) -> str:
    return "the same number" if _same(paper, measured) else _difference(paper, measured)


def _spread(paper: PaperNumber, measured: Measured, cohort_title: str) -> str:
    """Say whether the mean lies within the paper's mean ± sd, else by how much it does not."""
    if abs(measured.value - paper.value) <= paper.sd:
        return "within the paper's spread"
    difference = _difference(paper, measured)
    return f"outside the paper's spread: {difference}; {cohort_title}, other subjects than the paper's"


def _case(paper: PaperNumber, measured: Measured, cohort_title: str) -> str:
    if paper.printed.startswith(">") and measured.value > paper.value:
        return f"above {shown(paper.value, paper.row.digits)} too; another subject than the paper's"
    return f"{_difference(paper, measured)}; another subject than the paper's"


def _among(paper: PaperNumber, measured: Measured, cohort_title: str) -> str:
    """Place the paper's value among those of the excluded subjects here."""
    low, high = min(measured.several), max(measured.several)
    where = "within" if low <= paper.value <= high else "below" if paper.value < low else "above"
    return f"the paper's value is {where} those of the subjects excluded here, which are other subjects"


def _beyond_prior(paper: PaperNumber, measured: Measured, cohort_title: str) -> str:
    """Count the excluded subjects whose median lies beyond the bound of the paper's prior."""
    bound, values = float(paper.row.of["bound"]), measured.several
    beyond = sum(value > bound for value in values)
    text = f"beyond the paper's bound of {bound:g} in {beyond} of {len(values)} excluded subjects"
    return f"{text}, as in the paper" if beyond == len(values) else text


def _all_inside(paper: PaperNumber, measured: Measured, cohort_title: str) -> str:
    if measured.value == measured.n:
        return "holds in every supported case, as in the paper"
    return f"holds in {shown(measured.value, 0)} of {measured.n} supported cases, in the paper in all"


def _binomial(paper: PaperNumber, measured: Measured, cohort_title: str) -> str:
    if not differ(paper.value / 100.0, PAPER_RECORDINGS, measured.value / 100.0, measured.n):
        return "no difference beyond binomial error"
    return f"{_difference(paper, measured)} percentage points, beyond binomial error"


def _words(paper: PaperNumber, measured: Measured, cohort_title: str) -> str:
    """Compare what stands before the details of this study's value."""
    said = measured.text.split(" (")[0].split(":")[0]
    if said.startswith("in "):
        return "holds in part of the subjects"
    return "as in the paper" if said == paper.printed else "differs from the paper"


def _same(paper: PaperNumber, measured: Measured) -> bool:
    return abs(measured.value - paper.value) <= 1e-9 * max(abs(paper.value), 1e-12)


def _difference(paper: PaperNumber, measured: Measured) -> str:
    """Say which value is higher, by the decimals that are shown."""
    digits = paper.row.digits
    difference = round(measured.value, digits) - round(paper.value, digits)
    if shown(difference, digits) == shown(0.0, digits):
        return "equal to the digits printed"
    return f"{'higher' if difference > 0.0 else 'lower'} by {shown(abs(difference), digits)}"


READINGS: Final[Mapping[str, Reading]] = {
    "configured": _configured,
    "identity": _identity,
    "protocol": _protocol,
    "count": _count,
    "spread": _spread,
    "case": _case,
    "among": _among,
    "beyond_prior": _beyond_prior,
    "all_inside": _all_inside,
    "binomial": _binomial,
    "words": _words,
}


def comparison_table(paper: Sequence[PaperNumber], study: StudyResults) -> pd.DataFrame:
    """Return the columns ``COLUMNS``, all text, every cell filled; rows in the order of ``paper``.

    Raises:
        ReadingError: A row names a measure or a reading that does not exist.
    """
    return pd.DataFrame(list(_rows(paper, study)), columns=list(COLUMNS))


def _rows(paper: Sequence[PaperNumber], study: StudyResults) -> Iterator[tuple[str, ...]]:
    for printed in paper:
        row = printed.row
        if row.measure not in MEASURES:
            raise ReadingError(f"{printed.quantity}: there is no measure {row.measure!r}")
        measured = MEASURES[row.measure](study, printed)
        note = read_difference(printed, measured, study.cohort_title)
        yield printed.quantity, printed.printed, measured.text, note, origin(printed, study.main)
