"""Tables of trainings, epoch by epoch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pandas as pd

from swesbi.report.csv import write_csv

if TYPE_CHECKING:
    from swesbi.networks.flow.training import SplineEpoch

NAN: Final = float("nan")
VALIDATION_LOSS: Final = "validation_loss"
FRESH_LOSS: Final = "fresh_loss"
RECOVERY_COVERAGE: Final = "recovery_coverage"
RELATIVE_SD: Final = "posterior_sd_over_prior_sd"
IN_PRIOR: Final = "in_prior_share"
COVERAGE_PHASES: Final = "coverage_phases"
COVERAGE_GRID: Final = "coverage_grid"
RMSE: Final = "rmse_kpa"


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
            prior-supported.
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
