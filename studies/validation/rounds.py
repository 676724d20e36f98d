r"""Add a round to the stored tables: what came out, which model was asked, when.

    python -m studies.validation.rounds results/studies/validation/validation.csv --round 3 \
        --date 2026-11-27 --model "passive stiffness by its two ends and its middle"

Rows of the table go behind those of `tables/rounds.csv`, rows of the table of samplers beside it behind
those of `tables/rounds_samplers.csv`. What is asked and what came out is printed in sentences.
"""

from __future__ import annotations

import argparse
import datetime
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import pandas as pd

from swesbi.artefacts.csv import read_csv, write_csv
from swesbi.report.tables.validation import OF_ROUND, ROUNDS, VALIDATION, compared_width, in_brief

STORED: Final = Path(__file__).with_name("tables") / "rounds.csv"


def main(arguments: Sequence[str] | None = None) -> None:
    """Add a round, and print what came out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("table", type=Path, help="validation.csv of the round")
    parser.add_argument("--round", type=int, required=True, help="its number")
    parser.add_argument("--date", type=datetime.date.fromisoformat, required=True, help="day of its end")
    parser.add_argument("--model", required=True, help="what was changed of the model before it, in words")
    parser.add_argument(
        "--stored", type=Path, default=STORED, help="table of all rounds; default: %(default)s"
    )
    given = parser.parse_args(arguments)
    add(given.table, given.stored, {"round": given.round, "date": given.date, "model": given.model})
    rounds = ROUNDS.read(given.stored)
    added = rounds[rounds["round"] == given.round]
    print("\n".join(in_brief(added, compared_width(rounds, given.round))))


def add(table: Path, stored: Path, of_round: Mapping[str, object]) -> None:
    """Add the rows of a round to the stored table, and those of its samplers; a stored number is refused.

    The tables of samplers lie beside both. ``of_round`` has the values of the columns ``OF_ROUND``.
    """
    pairs = {stored: VALIDATION.read(table), _samplers(stored): read_csv(_samplers(table))}
    before = {path: read_csv(path) for path in pairs}
    if (before[stored]["round"] == of_round["round"]).any():
        raise ValueError(f"{stored}: holds a round {of_round['round']} already")
    for path, rows in pairs.items():
        for place, name in enumerate(OF_ROUND):
            rows.insert(place, name, [of_round[name]] * len(rows))
        write_csv(path, pd.concat([before[path], rows]))


def _samplers(table: Path) -> Path:
    return table.with_name(f"{table.stem}_samplers.csv")


if __name__ == "__main__":
    main()
