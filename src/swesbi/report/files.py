"""Where every result lies: links relative to the page, grouped by what they belong to."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from swesbi.report.table import Link, Row, Table, words

HERE: Final = "."
WHOLE_COHORT: Final = "whole cohort"
MEANING: Final = {
    HERE: "beside this page.",
    "tables": "every table of the study, as CSV, and table 1 as LaTeX.",
    "figures": "figures of the cohort, as PDF and PNG.",
    "cohort": "noise of the speeds; observed curve with errors and rejected samples; passive baseline.",
    "cmaes": "reference fits by CMA-ES: history of every seed, best fit.",
    "simulations": "simulations from each prior, in shards.",
}
EXPERIMENT_MEANING: Final = (
    "training set, network and losses of the experiment; verdict, posterior, predictive check and figures "
    "of each subject."
)


def relative(path: Path, page: Path) -> str:
    """Return how the page refers to a file."""
    return Path(os.path.relpath(path, page.parent)).as_posix()


def file_groups(paths: Sequence[Path], page: Path) -> tuple[Table, ...]:
    """Group the files by the folder that they lie in, in the order given; one row a subject or kind."""
    grouped: dict[str, dict[str, list[Link]]] = {}
    for path in dict.fromkeys(paths):
        href = relative(path, page)
        folder, *rest = Path(href).parts if "/" in href else (HERE, href)
        row, text = _row_and_text(rest)
        grouped.setdefault(folder, {}).setdefault(row, []).append(Link(text, href))
    return tuple(_group(folder, rows) for folder, rows in grouped.items())


def _row_and_text(parts: Sequence[str]) -> tuple[str, str]:
    """Return the row of a file within its group, and what its link says.

    Examples: ``paper/subjects/A/ppc.png`` is ppc.png of A, ``cmaes/A.h5`` is A.h5 of the cohort.
    """
    *folders, name = [part for part in parts if part != "subjects"]
    return ", ".join(folders) or WHOLE_COHORT, name


def _group(folder: str, rows: dict[str, list[Link]]) -> Table:
    return Table(
        f"{folder}/: {MEANING.get(folder, EXPERIMENT_MEANING)}",
        words("Of", "Files"),
        tuple(Row((name, tuple(links))) for name, links in rows.items()),
    )
