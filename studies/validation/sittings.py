r"""Add a sitting to the stored tables: what came out, which model was asked, when.

    python -m studies.validation.sittings results/studies/validation/validation.csv --sitting 3 \
        --date 2026-11-27 --model "passive stiffness by its two ends and its middle"

Rows of the table go behind those of `tables/sittings.csv`, rows of the table of samplers beside it behind
those of `tables/sittings_samplers.csv`. What is asked and what came out is printed in sentences.
"""

from __future__ import annotations

import argparse
import datetime
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import pandas as pd

from swesbi.artefacts.csv import read_csv, write_csv
from swesbi.report.tables.validation import OF_SITTING, SITTINGS, VALIDATION, compared_width
from swesbi.report.tables.validation_outcomes import in_brief

STORED: Final = Path(__file__).with_name("tables") / "sittings.csv"


def main(arguments: Sequence[str] | None = None) -> None:
    """Add a sitting, and print what came out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("table", type=Path, help="validation.csv of the sitting")
    parser.add_argument("--sitting", type=int, required=True, help="its number")
    parser.add_argument("--date", type=datetime.date.fromisoformat, required=True, help="day of its end")
    parser.add_argument("--model", required=True, help="what was changed of the model before it, in words")
    parser.add_argument(
        "--stored", type=Path, default=STORED, help="table of all sittings; default: %(default)s"
    )
    given = parser.parse_args(arguments)
    add(given.table, given.stored, {"sitting": given.sitting, "date": given.date, "model": given.model})
    sittings = SITTINGS.read(given.stored)
    added = sittings[sittings["sitting"] == given.sitting]
    print("\n".join(in_brief(added, compared_width(sittings, given.sitting))))


def add(table: Path, stored: Path, of_sitting: Mapping[str, object]) -> None:
    """Add the rows of a sitting to the stored table, and those of its samplers.

    Args:
        table: ``validation.csv``; the table of samplers lies beside it.
        stored: Table of all sittings; that of their samplers lies beside it.
        of_sitting: Values of the columns ``OF_SITTING``.

    Raises:
        ArtefactError: The table is none of the validation.
        FileNotFoundError: No other table lies beside it.
        ValueError: A sitting of this number is stored already.
    """
    pairs = {stored: VALIDATION.read(table), _samplers(stored): read_csv(_samplers(table))}
    before = {path: read_csv(path) for path in pairs}
    if (before[stored]["sitting"] == of_sitting["sitting"]).any():
        raise ValueError(f"{stored}: holds a sitting {of_sitting['sitting']} already")
    for path, rows in pairs.items():
        for place, name in enumerate(OF_SITTING):
            rows.insert(place, name, [of_sitting[name]] * len(rows))
        write_csv(path, pd.concat([before[path], rows]))


def _samplers(table: Path) -> Path:
    return table.with_name(f"{table.stem}_samplers.csv")


if __name__ == "__main__":
    main()
