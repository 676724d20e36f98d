"""``training.csv``: one row an epoch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from swesbi.tables.files import write_csv

if TYPE_CHECKING:
    from swesbi.flow.training import FlowEpoch


def write_epochs(path: Path, epochs: Sequence[FlowEpoch]) -> None:
    """Write the losses of every epoch of a flow's training."""
    frame = pd.DataFrame([asdict(epoch) for epoch in epochs]).rename(columns={"number": "epoch"})
    frame["best_so_far"] = frame["best_so_far"].astype(int)
    write_csv(path, frame, float_format=None)
