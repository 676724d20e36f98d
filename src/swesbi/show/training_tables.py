"""Tables of trainings, epoch by epoch, and of volunteers recorded under several acquisition seeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pandas as pd

from swesbi.show.csv import write_csv

if TYPE_CHECKING:
    from swesbi.networks.spline.training import SplineEpoch

NAN: Final = float("nan")
VALIDATION_LOSS: Final = "validation_loss"
FRESH_LOSS: Final = "fresh_loss"
RECOVERY_COVERAGE: Final = "recovery_coverage"
RELATIVE_SD: Final = "posterior_sd_over_prior_sd"
IN_PRIOR: Final = "in_prior_share"
COVERAGE_PHASES: Final = "coverage_phases"
COVERAGE_GRID: Final = "coverage_grid"
RMSE: Final = "rmse_kpa"
SCORES: Final = ("rmse_kpa", "rmse_reduction_percent", "r2", "coverage_grid", "coverage_phases")
"""Scores of the posterior predictive; they exist where the recording is supported."""


@dataclass(frozen=True, kw_only=True)
class EpochRow:
    """One quantity after one epoch.

    Attributes:
        epoch: Number of the epoch, from 1.
        best: Its validation loss is the lowest: the study uses the network of this epoch.
        quantity: Name of the quantity, with its unit unless it is dimensionless.
        subject: The subject, where the quantity has one.
        parameter: The parameter, where it has one.
        value: The value; NaN where too few draws lie within the prior's bounds, or the subject is not
            supported.
        ci_low: Lower end of the interval on a mean or a coverage over synthetic recordings, which the
            setting ``recovery.confidence`` sizes.
        ci_high: Its upper end.
        n: Synthetic recordings, or draws, behind the value.
    """

    epoch: int
    best: bool
    quantity: str
    subject: str = ""
    parameter: str = ""
    value: float = NAN
    ci_low: float = NAN
    ci_high: float = NAN
    n: int = 0


def epochs_table(rows: Sequence[EpochRow]) -> pd.DataFrame:
    """Return one row a quantity and epoch; ``best`` as 0 or 1."""
    return pd.DataFrame([asdict(row) for row in rows]).astype({"best": int})


def write_epochs(path: Path, epochs: Sequence[SplineEpoch]) -> None:
    """Write the losses of every epoch of a flow's training."""
    frame = pd.DataFrame([asdict(epoch) for epoch in epochs]).rename(columns={"number": "epoch"})
    frame["best_so_far"] = frame["best_so_far"].astype(int)
    write_csv(path, frame, float_format=None)


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
