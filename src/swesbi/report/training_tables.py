"""Tables of trainings, epoch by epoch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pandas as pd

from swesbi.artefacts.csv import write_csv

if TYPE_CHECKING:
    from swesbi.networks.flow.training import SplineEpoch
    from swesbi.networks.paper.sbi_trainer import Epoch

VALIDATION_LOSS: Final = "validation_loss"
FRESH_LOSS: Final = "fresh_loss"
RECOVERY_COVERAGE: Final = "recovery_coverage"
RELATIVE_SD: Final = "posterior_sd_over_prior_sd"
IN_PRIOR: Final = "in_prior_share"
COVERAGE_PHASES: Final = "coverage_phases"
COVERAGE_GRID: Final = "coverage_grid"
RMSE: Final = "rmse_kpa"


def write_epochs(path: Path, epochs: Sequence[Epoch | SplineEpoch]) -> None:
    """Write the losses of every epoch of a training."""
    frame = pd.DataFrame([asdict(epoch) for epoch in epochs]).rename(columns={"number": "epoch"})
    frame["best_so_far"] = frame["best_so_far"].astype(int)
    write_csv(path, frame, float_format=None)
