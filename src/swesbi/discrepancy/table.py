"""The table over the grid: total evidence, coverage of the truth, misfit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from swesbi.discrepancy.evidence import PairScore
from swesbi.parameters import THETA_NAMES
from swesbi.speed_model.settings import DiscrepancySettings


def discrepancy_table(
    pairs: Sequence[DiscrepancySettings],
    scores: Sequence[Sequence[PairScore]],
    phases: Sequence[int],
    interval: float,
) -> pd.DataFrame:
    """Return one row a pair.

    Columns: speed_fraction, timing_cycle, log_evidence (total) and its Monte Carlo standard error,
    below_best (total log evidence of the best pair less that of the row) and its standard error over
    subjects, coverage of each true parameter, mean chi2, its expectation phases (mean number of measured
    phases, less whatever the parameters fit), least effective draws of any subject, subjects, best (1 or 0).

    Args:
        pairs: K pairs.
        scores: Of each subject, the scores of the K pairs.
        phases: Measured phases of each subject.
        interval: Mass of the intervals whose coverage is counted.
    """
    evidence = np.array([[score.log_evidence for score in row] for row in scores])
    best = int(evidence.sum(axis=0).argmax())
    below = evidence[:, [best]] - evidence
    rows = []
    for index, pair in enumerate(pairs):
        own = [row[index] for row in scores]
        covered = np.mean([score.covered(interval) for score in own], axis=0)
        rows.append(
            {
                "speed_fraction": pair.speed_fraction,
                "timing_cycle": pair.timing_cycle,
                "log_evidence": evidence[:, index].sum(),
                "log_evidence_se": float(np.sqrt(sum(score.log_evidence_se**2 for score in own))),
                "below_best": below[:, index].sum(),
                "below_best_se": _standard_error_of_sum(below[:, index]),
            }
            | {f"coverage_{name}": share for name, share in zip(THETA_NAMES, covered, strict=True)}
            | {
                "mean_chi2": float(np.mean([score.chi2 for score in own])),
                "mean_phases": float(np.mean(phases)),
                "min_effective_draws": min(score.effective_draws for score in own),
                "subjects": len(own),
                "best": int(index == best),
            }
        )
    return pd.DataFrame(rows)


def best_pair(table: pd.DataFrame) -> DiscrepancySettings:
    """Return the pair with the highest total log evidence."""
    row = table.iloc[int(table["log_evidence"].argmax())]
    return DiscrepancySettings(
        speed_fraction=float(row["speed_fraction"]), timing_cycle=float(row["timing_cycle"])
    )


def _standard_error_of_sum(differences: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    if len(differences) < 2:
        return float("nan")
    return float(np.sqrt(len(differences)) * differences.std(ddof=1))
