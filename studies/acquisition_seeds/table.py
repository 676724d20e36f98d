"""Tables of volunteers recorded under several acquisition seeds: a row for each recording, and medians."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Final

import pandas as pd

NAN: Final = float("nan")
SCORES: Final = ("rmse_kpa", "rmse_reduction_percent", "r2", "coverage_grid", "coverage_phases")
"""Scores of the posterior predictive; they exist where the recording is supported."""


@dataclass(frozen=True, kw_only=True)
class SeedRow:
    """One recording of one subject; NaN and empty where a value does not exist.

    Attributes:
        subject: Name.
        acquisition_seed: Seed of the recording's noise.
        shipped: It is the recording of the study.
        accepted: Ingestion and passive calibration accepted it.
        within_z: No component of its conditioning vector is farther out than admitted.
        enough_draws: Enough candidate draws lie within the prior's bounds.
        supported: Both criteria hold.
        max_abs_z: Largest |z| of the conditioning vector.
        worst_component: The component that attains it.
        in_prior_draws: Draws within the prior's bounds, of those drawn.
        candidate_draws: Draws; drawing stops when enough lie within the bounds.
        rmse_prior_kpa: Error of the prior predictive median, on the grid.
        rmse_kpa: Error of the posterior predictive median, on the grid.
        rmse_reduction_percent: By how much the second is less than the first.
        r2: Coefficient of determination of the posterior predictive median.
        coverage_grid: Share of the observed curve's grid points inside the band of noiseless curves.
        coverage_phases: Share of the measured phases inside it.
        reason: Why the recording was refused or is not supported.
    """

    subject: str
    acquisition_seed: int
    shipped: bool
    accepted: bool
    within_z: bool = False
    enough_draws: bool = False
    supported: bool = False
    max_abs_z: float = NAN
    worst_component: str = ""
    in_prior_draws: int = 0
    candidate_draws: int = 0
    rmse_prior_kpa: float = NAN
    rmse_kpa: float = NAN
    rmse_reduction_percent: float = NAN
    r2: float = NAN
    coverage_grid: float = NAN
    coverage_phases: float = NAN
    reason: str = ""


def seeds_table(rows: Sequence[SeedRow]) -> pd.DataFrame:
    """Return one row a recording, truth values as 0 and 1."""
    table = pd.DataFrame([asdict(row) for row in rows])
    flags = table.select_dtypes(bool).columns
    return table.astype(dict.fromkeys(flags, int))


def medians_table(recordings: pd.DataFrame) -> pd.DataFrame:
    """Return one row a subject, in the order of the recordings: counts and medians over the seeds.

    max |z| and the prior's error are medians over all accepted recordings; the scores of the posterior
    over the supported ones, and empty where there is none.
    """
    return pd.DataFrame([_medians(group) for _, group in recordings.groupby("subject", sort=False)])


def _medians(group: pd.DataFrame) -> dict[str, object]:
    counted = ("within_z", "enough_draws", "supported")
    supported = group[group["supported"] == 1]
    return {
        "subject": group["subject"].iloc[0],
        "seeds": len(group),
        **{f"seeds_{name}": int(group[name].sum()) for name in counted},
        "max_abs_z": group["max_abs_z"].median(),
        "rmse_prior_kpa": group["rmse_prior_kpa"].median(),
        **{name: supported[name].median() for name in SCORES},
    }
