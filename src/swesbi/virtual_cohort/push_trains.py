"""Free-running recordings of virtual volunteers: ``python -m swesbi.virtual_cohort.push_trains FOLDER``.

What most cardiac elastography records: pushes at an even rate over not quite two beats of varying length,
with no gating, no repeats, and about half of the pushes lost.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from swesbi.context import Context
from swesbi.recording.columns import SPEED, STATUS_OK, TIME
from swesbi.recording.phases import sample_cycle
from swesbi.recording.speed import shear_wave_speed_m_s
from swesbi.seeds import generator
from swesbi.virtual_cohort.files import write_csv, write_text
from swesbi.virtual_cohort.readme import truth_table
from swesbi.virtual_cohort.settings import ACQUISITION_SEED
from swesbi.virtual_cohort.volunteers import VOLUNTEERS, Truth, TruthCurve, simulate_truth

PUSHES_PER_S: Final = 34.0
BEATS: Final = 1.8
RR_JITTER: Final = 0.05  # relative standard deviation of the beats of a train
LOST: Final = 0.46  # probability that a push gives no wave
ERROR: Final = 0.1  # relative standard deviation of a speed
ERROR_LOG_SD: Final = 0.3  # of its logarithm, as the recordings declare it
DENSITY_KG_M3: Final = 1000.0
RECORDING: Final = """\
# How the recordings of this cohort were made
origin: virtual push trains of virtual volunteers (swesbi.virtual_cohort.push_trains); not measured on people
acquisition_seed: {seed}
noise: {{ cv_fraction: {error:g}, cv_log_sd: {log_sd:g} }} # no repeats tell it: declared, and integrated out
"""
README: Final = """\
# Virtual push trains

**Nobody was measured.** These are simulated recordings without gating and without repeats.

**A to H** are the eight virtual volunteers of `data/virtual_volunteers`, as a free-running push train would
record them: {rate:g} pushes a second over {beats:g} beats, beats that vary by {jitter:.0f} %,
{lost:.0f} % of the pushes without a wave, an error of {error:.0f} % of each speed. The noise is independent
from push to push; that of a held probe is not.

| file | content |
|---|---|
| `subjects.csv` | contexts, as in `data/virtual_volunteers` |
| `swe/<subject>.csv` | one row a push: time since the R peak of its beat, RR, beat, speed, status |
| `recording.yaml` | what is declared of the errors |
| `truth.csv` | the parameters that made the recordings; nothing that infers reads it |

The volunteers' physiology is richer than the model's ([their README](../virtual_volunteers/README.md)), so
its best parameters need not equal these.

Made by `python -m swesbi.virtual_cohort.push_trains data/virtual_push_trains`; a test makes them again
and compares every byte.
"""


def push_train(truth: Truth, seed: int) -> pd.DataFrame:
    """Return the push train of a volunteer, a row a push; each volunteer has a stream of its own."""
    context = truth.volunteer.context
    return record_train(truth.curve, context, generator(seed, "push train", context.subject))


def record_train(curve: TruthCurve, context: Context, rng: np.random.Generator) -> pd.DataFrame:
    """Record a heart by a push train, a row a push.

    Args:
        curve: Noiseless total stiffness.
        context: Whose.
        rng: Draws beats, errors and losses.
    """
    period_ms = 1e3 * context.period_s
    lengths = np.round(period_ms * (1.0 + RR_JITTER * rng.standard_normal(int(np.ceil(BEATS)) + 1)))
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    at = np.arange(0.0, BEATS * period_ms, 1e3 / PUSHES_PER_S)
    beat = np.searchsorted(starts, at, side="right") - 1
    time = np.round(at - starts[beat], 1)
    stiffness = sample_cycle(curve.cycle_phase, curve.stiffness_kpa[None], (time / lengths[beat]) % 1.0)
    speed = shear_wave_speed_m_s(stiffness[0], DENSITY_KG_M3) * np.exp(ERROR * rng.standard_normal(len(at)))
    lost = rng.random(len(at)) < LOST
    return pd.DataFrame(
        {
            TIME: time,
            "rr_ms": lengths[beat].astype(np.int64),
            "beat": beat,
            SPEED: np.where(lost, np.nan, np.round(speed, 3)),
            "status": np.where(lost, "no_wave", STATUS_OK),
        }
    )


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
    """Write the virtual push trains into the folder named on the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m swesbi.virtual_cohort.push_trains", description=main.__doc__
    )
    parser.add_argument("folder", type=Path, help="for example data/virtual_push_trains")
    write_push_trains(parser.parse_args(sys.argv[1:]).folder, ACQUISITION_SEED)


if __name__ == "__main__":
    main()
