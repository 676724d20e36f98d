"""The generated parts of the page on the ladder of structures, from its committed tables."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Self

import pandas as pd

from swesbi.checks.ladder.posteriors import CHOSEN, SHIPPED
from swesbi.checks.ladder.summary import total_evidence
from swesbi.checks.ladder.table import ABOUT_PEOPLE, AVERAGE
from swesbi.checks.settings import BASE
from swesbi.show.docs.results import read_table
from swesbi.show.numbers import fixed, share, significant
from swesbi.show.results import records
from swesbi.show.table import markdown, of_records

MISSING: Final = "Not measured yet: `make ladder` on a finished study."
TABLES: Final = ("ladder", "ladder_pairs", "ladder_moves")
POSTERIORS_SHOWN: Final = {
    "k0_kpa": "k_0 (kPa), conditional on the structure",
    "attained_kpa": "attained stiffness (kPa)",
    "shown_kpa": "shown stiffness (kPa)",
    "k_sr_per_s": "k_SR (1/s)",
    "change_of_k0_kpa": "change of k_0 (ratio)",
    "change_of_k_sr_per_s": "change of k_SR (ratio)",
}


@dataclass(frozen=True)
class LadderResults:
    """Tables of the ladder: ``ladder.csv``, ``ladder_pairs.csv`` and ``ladder_moves.csv``."""

    table: pd.DataFrame
    pairs: pd.DataFrame
    moves: pd.DataFrame

    @classmethod
    def read(cls, folder: Path) -> Self | None:
        """Read the tables of a folder; None before ``make ladder``."""
        paths = [folder / f"{name}.csv" for name in TABLES]
        return cls(*map(read_table, paths)) if all(path.is_file() for path in paths) else None


def evidence_part(results: LadderResults | None) -> str:
    """Show total evidence and chosen discrepancy of each structure, and what the evidence is not."""
    if results is None:
        return MISSING
    total = total_evidence(results.table).set_index(["answer", "structure"])
    best = results.pairs[results.pairs["best_covering"] == 1].set_index("structure")
    rows = []
    for name in dict.fromkeys(total.index.get_level_values("structure")):
        shipped, own, covering = total.loc[(SHIPPED, name)], total.loc[(CHOSEN, name)], best.loc[name]
        rows.append(
            {
                "structure": str(shipped["label"]),
                "log evidence less the base's, shipped delta and tau": _with_error(shipped, "against_base"),
                "probability for the cohort": share(shipped["probability"], 1),
                "evidence's own delta, tau": _pair(own),
                "log evidence less the base's, each at its own": _with_error(own, "against_base"),
                "best delta, tau not below the shipped": _pair(covering),
            }
        )
    return f"{markdown(of_records(rows))}\n\n{ABOUT_PEOPLE}\n\n![The ladder](figures/ladder.png)"


def _with_error(row: pd.Series, name: str) -> str:
    return f"{fixed(row[name], 1)} ± {fixed(row['log_evidence_se'], 1)}"


def _pair(row: pd.Series) -> str:
    return f"{share(row['speed_fraction'], 1)}, {share(row['timing_cycle'], 2)}"


def posteriors_part(results: LadderResults | None) -> str:
    """Show the posterior medians of every structure by subject, and the average over structures."""
    if results is None:
        return MISSING
    shipped = results.table[results.table["answer"] == SHIPPED]
    parts = []
    for quantity, title in POSTERIORS_SHOWN.items():
        rows = shipped[shipped["quantity"] == quantity]
        lines = [
            {title: str(label)} | {str(row["subject"]): _cell(row) for row in records(part)}
            for label, part in rows.groupby("label", sort=False)
        ]
        parts.append(markdown(of_records(lines)))
    return "\n\n".join([*parts, ABOUT_PEOPLE])


def _cell(row: Mapping[Hashable, Any]) -> str:
    median = significant(float(row["median"]))
    if row["structure"] in (BASE, AVERAGE):
        low, high = (significant(float(row[name])) for name in ("ci_low", "ci_high"))
        return f"{median} ({low} to {high})"
    return median


def moves_part(results: LadderResults | None) -> str:
    """Show how far each quantity moves, and name what survives."""
    if results is None:
        return MISSING
    labels = results.table.groupby("structure")["label"].first()
    rows = [
        {
            "quantity": str(row["words"]),
            "largest move (widths)": fixed(float(row["largest_shift"]), 2),
            "by": f"{labels[row['structure']]}, {row['subject']}",
            "structures and subjects within": share(float(row["within"]), 0),
            "average over structures (widths)": fixed(float(row["average_shift"]), 2),
            "survives": "yes" if int(row["survives"]) else "no",
        }
        for row in records(results.moves)
    ]
    survivors = [str(row["quantity"]) for row in rows if row["survives"] == "yes"]
    named = "; ".join(survivors) if survivors else "nothing"
    return f"{markdown(of_records(rows))}\n\nWhat survives: {named}."


PARTS: Final[Mapping[str, Callable[[LadderResults | None], str]]] = {
    "ladder_evidence": evidence_part,
    "ladder_posteriors": posteriors_part,
    "ladder_moves": moves_part,
}
