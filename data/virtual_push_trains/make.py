"""Make the virtual push trains anew: ``python data/virtual_push_trains/make.py [FOLDER]``.

README.md beside it says what they are.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Final

import pandas as pd

sys.path.insert(0, str(Path(__file__).parents[2]))  # the project's folder, where `data` is found

from data.makers.files import write_csv, write_text
from data.makers.tables import truth_table
from swesbi.recording.settings import ACQUISITION_SEED
from swesbi.virtual.push_trains import (
    BEATS,
    ERROR,
    ERROR_LOG_SD,
    LOST,
    PUSHES_PER_S,
    RR_JITTER,
    push_train,
)
from swesbi.virtual.volunteers import VOLUNTEERS, simulate_truth

RECORDING: Final = """\
# How the recordings of this cohort were made
origin: virtual push trains of virtual volunteers (swesbi.virtual.push_trains); not measured on people
noise: {{ cv_fraction: {error:g}, cv_log_sd: {log_sd:g} }} # no repeats tell it: declared, and integrated out
sources: {{ acquisition_seed: {seed} }}
"""
README: Final = """\
# Virtual push trains

**Nobody was measured.** These are simulated recordings without gating and without repeats.

**A to H** are the eight virtual volunteers of `data/virtual_volunteers`, recorded by a free-running push
train: {rate:g} pushes per second over {beats:g} beats. Beats vary by {jitter:.0f} %, and {lost:.0f} % of the
pushes have no wave. Each speed has an error of {error:.0f} %. The errors are independent from push to push;
with a hand-held probe they are not.

| file | content |
|---|---|
| `subjects.csv` | contexts, as in `data/virtual_volunteers` |
| `swe/<subject>.csv` | one row per push: time since the R peak of its beat, RR, beat, speed, status |
| `recording.yaml` | the declared size of the errors |
| `truth.csv` | the true parameters; no inference reads them |

The volunteers' equations are not the model's ([their README](../virtual_volunteers/README.md)).
So the model's best parameters need not equal these.

`python data/virtual_push_trains/make.py` makes the files. A test makes them again and compares every byte.
"""


def write_push_trains(folder: Path, seed: int) -> None:
    """Write contexts, push trains, truth and README into ``folder``."""
    (folder / "swe").mkdir(parents=True, exist_ok=True)
    truths = [simulate_truth(volunteer) for volunteer in VOLUNTEERS]
    for truth in truths:
        write_csv(folder / "swe" / f"{truth.volunteer.context.subject}.csv", push_train(truth, seed))
    contexts = pd.DataFrame([asdict(truth.volunteer.context) for truth in truths])
    write_csv(folder / "subjects.csv", contexts.astype(object))
    write_csv(folder / "truth.csv", truth_table(truths))
    write_text(folder / "recording.yaml", RECORDING.format(seed=seed, error=ERROR, log_sd=ERROR_LOG_SD))
    percent = {"jitter": 100.0 * RR_JITTER, "lost": 100.0 * LOST, "error": 100.0 * ERROR}
    write_text(folder / "README.md", README.format(rate=PUSHES_PER_S, beats=BEATS, **percent))


def main() -> None:
    """Write the virtual push trains into a folder."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument(
        "folder", type=Path, nargs="?", default=Path(__file__).parent, help="default: that of this program"
    )
    write_push_trains(parser.parse_args().folder, ACQUISITION_SEED)


if __name__ == "__main__":
    main()
