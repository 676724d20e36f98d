"""Free-running recordings of virtual volunteers.

What most cardiac elastography records: pushes at an even rate over not quite two beats of varying length,
with no gating, no repeats, and about half of the pushes lost.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import pandas as pd

from swesbi.context import Context
from swesbi.recording.acquisition import TruthCurve
from swesbi.recording.phases import sample_cycle
from swesbi.recording.speed import shear_wave_speed_m_s
from swesbi.recording.tables.layout import SPEED, STATUS_OK, TIME
from swesbi.seeds import generator
from swesbi.virtual.volunteers import Truth

PUSHES_PER_S: Final = 34.0
BEATS: Final = 1.8
RR_JITTER: Final = 0.05  # relative standard deviation of the beats of a train
LOST: Final = 0.46  # probability that a push gives no wave
ERROR: Final = 0.1  # relative standard deviation of a speed
ERROR_LOG_SD: Final = 0.3  # of its logarithm, as the recordings declare it
DENSITY_KG_M3: Final = 1000.0


def push_train(truth: Truth, seed: int) -> pd.DataFrame:
    """Return the push train of a volunteer, a row a push; each volunteer has a stream of its own."""
    context = truth.volunteer.context
    return record_train(truth.curve, context, generator(seed, "push train", context.subject))


def record_train(curve: TruthCurve, context: Context, rng: np.random.Generator) -> pd.DataFrame:
    """Record a heart by a push train, a row a push."""
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
