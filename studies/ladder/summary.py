"""What the ladder comes to: evidence of the discrepancy under each structure, moves, total evidence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np
import pandas as pd
from scipy.special import softmax

from studies.ladder.posteriors import SHIPPED, StructureResult
from studies.ladder.quantities import QUANTITIES, WORDS
from studies.ladder.table import AVERAGE
from swesbi.base.arrays import BoolArray
from swesbi.checks.settings import BASE

MOVES: Final = (
    "quantity", "words", "largest_shift", "structure", "subject", "within", "average_shift", "survives",
)  # fmt: skip


def pairs_table(results: Mapping[str, StructureResult], labels: Mapping[str, str]) -> pd.DataFrame:
    """Return one row a structure and pair (delta, tau): total log evidence over the subjects.

    ``below_best`` is the total log evidence of the structure's best pair less that of the row; ``best`` is 1
    there; ``covering`` is 1 where neither delta nor tau is less than as shipped, which is what intervals need
    that contain the truth of generated hearts; ``best_covering`` marks the best of these.
    """
    rows = (
        {"structure": name, "label": label} | row
        for name, label in labels.items()
        for row in _pairs(results[name])
    )
    return pd.DataFrame(rows)


def _pairs(result: StructureResult) -> Iterator[dict[str, Any]]:
    total = np.sum([one.log_evidence for one in result.evidence], axis=0)
    error = np.sqrt(np.sum([one.log_evidence_se**2 for one in result.evidence], axis=0))
    least = np.min([one.effective_draws for one in result.evidence], axis=0)
    covering = _covering(result)
    best, best_covering = int(total.argmax()), int(np.where(covering, total, -np.inf).argmax())
    for index, pair in enumerate(result.pairs):
        yield {
            "speed_fraction": pair.speed_fraction,
            "timing_cycle": pair.timing_cycle,
            "log_evidence": total[index],
            "log_evidence_se": error[index],
            "below_best": total[best] - total[index],
            "min_effective_draws": least[index],
            "shipped": int(index == 0),
            "best": int(index == best),
            "covering": int(covering[index]),
            "best_covering": int(index == best_covering),
            "subjects": len(result.evidence),
        }


def _covering(result: StructureResult) -> BoolArray:
    """Tell which pairs are nowhere below the shipped one, the first."""
    shipped, *_ = result.pairs
    return np.array(
        [
            pair.speed_fraction >= shipped.speed_fraction and pair.timing_cycle >= shipped.timing_cycle
            for pair in result.pairs
        ]
    )


def moves_table(table: pd.DataFrame, survives_widths: float) -> pd.DataFrame:
    """Return how far each quantity moves, at the shipped discrepancy, and whether it survives.

    ``largest_shift`` is the largest move of any structure and subject, in widths of the base's interval, and
    the two columns after it say whose; ``within`` the share of structures and subjects that move it by less
    than ``survives_widths``; ``average_shift`` the largest move of the average over structures.
    """
    shipped = table[(table["answer"] == SHIPPED) & (table["structure"] != BASE)]
    rows = (
        {"quantity": name, "words": WORDS[str(name)]} | _moves(part, survives_widths)
        for name, part in shipped.groupby("quantity", sort=False)
    )
    return pd.DataFrame(rows, columns=list(MOVES))


def _moves(rows: pd.DataFrame, survives_widths: float) -> dict[str, Any]:
    """Return how far one quantity moves; rows of all structures but the base, and of their average."""
    average = rows["structure"] == AVERAGE
    of_structures = rows[~average]
    moved = of_structures["shift_in_widths"].abs().to_numpy()
    worst = int(moved.argmax())
    return {
        "largest_shift": moved[worst],
        "structure": of_structures["structure"].iloc[worst],
        "subject": of_structures["subject"].iloc[worst],
        "within": float((moved < survives_widths).mean()),
        "average_shift": rows.loc[average, "shift_in_widths"].abs().max(),
        "survives": int(moved[worst] < survives_widths),
    }


def total_evidence(table: pd.DataFrame) -> pd.DataFrame:
    """Return one row an answer and structure: log evidence of all subjects together, against the base's.

    Columns: answer, structure, label, log_evidence, log_evidence_se, against_base, probability (of the
    structure for the cohort, as one structure for all), speed_fraction, timing_cycle.
    """
    first = table[(table["quantity"] == QUANTITIES[0].name) & (table["structure"] != AVERAGE)]
    grouped = first.groupby(["answer", "structure"], sort=False)
    total = grouped.agg(
        label=("label", "first"),
        log_evidence=("log_evidence", "sum"),
        log_evidence_se=("log_evidence_se", lambda se: float(np.sqrt((se**2).sum()))),
        speed_fraction=("speed_fraction", "first"),
        timing_cycle=("timing_cycle", "first"),
    ).reset_index()
    base = total[total["structure"] == BASE].set_index("answer")["log_evidence"]
    total["against_base"] = total["log_evidence"] - total["answer"].map(base)
    total["probability"] = total.groupby("answer")["log_evidence"].transform(
        lambda each: softmax(each.to_numpy())
    )
    return total
