"""Writing the virtual cohort in the format of real recordings, with the truth apart."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from swesbi.recording.samples import Samples
from swesbi.virtual_cohort.picture import draw_recordings
from swesbi.virtual_cohort.readme import readme
from swesbi.virtual_cohort.record import record
from swesbi.virtual_cohort.tables import context_table, curve_table, truth_table
from swesbi.virtual_cohort.truth import simulate_truth
from swesbi.virtual_cohort.volunteers import VOLUNTEERS

RECORDING: Final = """\
# How the recordings of this cohort were made
origin: virtual volunteers, simulated by swesbi.virtual_cohort; not measured on people
acquisition_seed: {seed}
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
  samples_per_repeat: 12
density_kg_m3: 1000.0
sources:
  protocol: paper, Sec. 2.1
  speeds: see README.md
"""


def write_cohort(folder: Path, seed: int) -> None:
    """Write contexts, recordings, truth, picture and README of the six volunteers into ``folder``.

    If ``acquisition_seeds.csv`` lies there, the README shows it.
    """
    truths = [simulate_truth(volunteer) for volunteer in VOLUNTEERS]
    recordings = [record(truth, seed) for truth in truths]
    (folder / "swe").mkdir(parents=True, exist_ok=True)
    for truth, samples in zip(truths, recordings, strict=True):
        _write_csv(folder / "swe" / f"{truth.volunteer.context.subject}.csv", _plain(samples))
    _write_csv(folder / "subjects.csv", context_table(truths).astype(object))
    _write_csv(folder / "truth.csv", truth_table(truths))
    _write_csv(folder / "truth_curves.csv", curve_table(truths), "%.4f")
    _write_text(folder / "recording.yaml", RECORDING.format(seed=seed))
    medians = folder / "acquisition_seeds.csv"
    shown = pd.read_csv(medians, dtype=str, keep_default_na=False) if medians.is_file() else None
    _write_text(folder / "README.md", readme(truths, recordings, seed, shown))
    _write_picture(folder / "recordings.png", recordings)


def _plain(samples: Samples) -> pd.DataFrame:
    whole = {"trigger_delay_ms": np.int64, "rr_ms": np.int64}  # rounded to the millisecond when acquired
    return samples.frame().astype(whole)


def _write_csv(path: Path, table: pd.DataFrame, float_format: str | None = None) -> None:
    table.to_csv(path, index=False, lineterminator="\n", float_format=float_format)


def _write_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")


def _write_picture(path: Path, recordings: Sequence[Samples]) -> None:
    with plt.style.context("default"):
        figure = draw_recordings(VOLUNTEERS, recordings)
        figure.savefig(path, dpi=130, metadata={"Software": None})
        plt.close(figure)
