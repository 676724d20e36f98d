"""What the mixed model needs of a recording: mean and scatter of the log speeds of each repeat."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.recording.samples import Samples
from swesbi.recording.speed import phase_trend, repeat_means

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class RepeatLevels:
    """The repeats of one or more recordings, R of them; with the cells they are sufficient statistics.

    Attributes:
        cell: Subject and phase of each repeat as a number from 0, without gaps; shape (R,).
        size: Accepted samples; shape (R,).
        mean: Mean of the log speeds (c in m/s), the trend of the repeat's beat taken out; shape (R,).
        scatter: Sum of squared deviations of the samples' log speeds from their mean; shape (R,).
    """

    cell: IntArray
    size: IntArray
    mean: FloatArray
    scatter: FloatArray

    @property
    def samples(self) -> int:
        """Number of accepted samples."""
        return int(self.size.sum())

    @property
    def repeats(self) -> int:
        """Number of repeats R."""
        return len(self.size)

    @property
    def cells(self) -> int:
        """Number of measured phases, over the recordings."""
        return int(self.cell.max(initial=-1)) + 1


def repeat_levels(samples: Samples, accepted: NDArray[np.bool_]) -> RepeatLevels:
    """Reduce the accepted samples of one recording to its repeats.

    Repeats at one delay fall into beats of different RR, so at slightly different phases. What they
    differ by on the slope of the curve is no error, since the phase is averaged like the speed; it is
    taken out (:func:`swesbi.recording.speed.phase_trend`).

    Args:
        samples: The recording, N samples.
        accepted: Which samples passed quality control; shape (N,).
    """
    repeats = repeat_means(samples, accepted)
    keys = [samples.phase_index[accepted], samples.repeat[accepted]]
    log_speed = pd.Series(np.log(samples.speed_m_s[accepted]))
    mean = log_speed.groupby(keys).mean().to_numpy()
    deviation = log_speed - log_speed.groupby(keys).transform("mean")
    trend = np.log1p(phase_trend(repeats).to_numpy())
    return RepeatLevels(
        cell=np.unique(repeats["phase_index"], return_inverse=True)[1].astype(np.int64),
        size=repeats["size"].to_numpy(np.int64),
        mean=np.asarray(mean - trend, dtype=np.float64),
        scatter=np.asarray((deviation**2).groupby(keys).sum(), dtype=np.float64),
    )


def joined(recordings: Sequence[RepeatLevels]) -> RepeatLevels:
    """Join recordings; no two share a cell."""
    first = np.cumsum([0, *(levels.cells for levels in recordings)])
    return RepeatLevels(
        cell=np.concatenate([levels.cell + n for levels, n in zip(recordings, first, strict=False)]),
        size=np.concatenate([levels.size for levels in recordings]),
        mean=np.concatenate([levels.mean for levels in recordings]),
        scatter=np.concatenate([levels.scatter for levels in recordings]),
    )
