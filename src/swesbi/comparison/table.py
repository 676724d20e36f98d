"""The table of comparison: one row a number of the paper."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import pandas as pd

from swesbi.comparison import measures_design, measures_results, measures_statements
from swesbi.comparison.measured import Asked, Measure
from swesbi.comparison.reading import ReadingError, read_difference
from swesbi.comparison.results import StudyResults
from swesbi.tables.paper_values import PaperNumber

COLUMNS: Final = ("quantity", "paper", "this_study", "note")
MEASURES: Final[Mapping[str, Measure]] = {
    **measures_design.MEASURES,
    **measures_results.MEASURES,
    **measures_statements.MEASURES,
}


def comparison_table(paper: Sequence[PaperNumber], study: StudyResults) -> pd.DataFrame:
    """Return the columns ``COLUMNS``, all text, every cell filled; rows in the order of ``paper``.

    Raises:
        ReadingError: A row names a measure or a reading that does not exist.
    """
    return pd.DataFrame(list(_rows(paper, study)), columns=list(COLUMNS))


def _rows(paper: Sequence[PaperNumber], study: StudyResults) -> Iterator[tuple[str, str, str, str]]:
    for printed in paper:
        row = printed.row
        if row.measure not in MEASURES:
            raise ReadingError(f"{printed.quantity}: there is no measure {row.measure!r}")
        measured = MEASURES[row.measure](study, Asked(row.of, row.digits, printed.case))
        note = read_difference(printed, measured, study.cohort_title)
        yield printed.quantity, printed.printed, measured.text, note
