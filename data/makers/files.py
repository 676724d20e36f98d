"""Writing virtual recordings in the format of real ones."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from swesbi.recording.samples import Samples
from swesbi.recording.tables.layout import COLUMNS, DELAY, SPEED

WHOLE: Final = {"trigger_delay_ms": np.int64, "rr_ms": np.int64}  # rounded to the millisecond when acquired
RECORDING: Final = """\
# How the recordings of this cohort were made
origin: {origin}; not measured on people
protocol:               # as in the paper, Sec. 2.1, which the simulation stands for
  system: Verasonics Vantage
  probe: GE 6S-D
  push_frequency_mhz: 4.0
  push_duration_us: 300.0
  push_f_number: 1.0
  view: parasternal long axis
  region: basal anteroseptal interventricular septum, mid-myocardium
  phases: 20
  repeats: 3
  repeats_are: sweeps
  samples_per_repeat: {samples}
density_kg_m3: 1000.0
sources:
  protocol: paper, Sec. 2.1
  speeds: see README.md
  acquisition_seed: {seed}
"""


def write_recordings(folder: Path, recordings: Mapping[str, Samples]) -> None:
    """Write the raw samples of each subject into the cohort's folder, as CSV."""
    (folder / "swe").mkdir(parents=True, exist_ok=True)
    for subject, samples in recordings.items():
        write_csv(folder / "swe" / f"{subject}.csv", samples_table(samples).astype(WHOLE))


def samples_table(samples: Samples) -> pd.DataFrame:
    """Return the samples of a recording with the columns of its file, in their order."""
    names = {SPEED: "speed_m_s", DELAY: "time_ms"}
    values = {name: getattr(samples, names.get(name, name)) for name in COLUMNS}
    return pd.DataFrame(values)


def write_csv(path: Path, table: pd.DataFrame, float_format: str | None = None) -> None:
    """Write a table with one kind of line ends on every machine."""
    table.to_csv(path, index=False, lineterminator="\n", float_format=float_format)


def write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8, with one kind of line ends on every machine."""
    path.write_text(text, encoding="utf-8", newline="\n")
