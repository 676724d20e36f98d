"""The raw samples of one recording, in memory: one entry per attempted push sample."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.recording.problems import Problem, RecordingError

STATUS_OK: Final = "ok"
FAILED_STATUSES: Final = ("no_wave", "motion", "low_r2", "bound_hit")
SPEED: Final = "shear_wave_speed_m_s"
MODULUS: Final = "youngs_modulus_kpa"
COLUMNS: Final = (
    "phase_index",
    "trigger_delay_ms",
    "rr_ms",
    "repeat",
    "sample",
    SPEED,
    "fit_r2",
    "status",
)


@dataclass(frozen=True)
class Samples:
    """Columns of ``swe/<subject>.csv``, each of shape (N,), N attempted samples.

    Attributes:
        phase_index: Index of the gated phase, from 0.
        trigger_delay_ms: Delay of the push from the R peak.
        rr_ms: RR interval of the beat in which the sample was taken.
        repeat: Index of the repeated acquisition at that phase.
        sample: Index of the spatial sample within the repeat.
        speed_m_s: Shear-wave speed c_s; NaN where the estimate failed.
        fit_r2: R2 of the wave fit; NaN where there was none.
        status: "ok" or one of ``FAILED_STATUSES``.
        source: Where the samples come from, for messages.
    """

    phase_index: NDArray[np.int64]
    trigger_delay_ms: NDArray[np.float64]
    rr_ms: NDArray[np.float64]
    repeat: NDArray[np.int64]
    sample: NDArray[np.int64]
    speed_m_s: NDArray[np.float64]
    fit_r2: NDArray[np.float64]
    status: NDArray[np.str_]
    source: str = "samples in memory"

    def __post_init__(self) -> None:
        known = np.isin(self.status, (STATUS_OK, *FAILED_STATUSES))
        if not known.all():
            reason = f"is none of {', '.join((STATUS_OK, *FAILED_STATUSES))}"
            value = str(self.status[~known][0])
            raise RecordingError(
                Problem(self.source, reason, "use one of them", column="status", value=value)
            )

    @property
    def beat_phase(self) -> NDArray[np.float64]:
        """Phase of each sample in its own beat, trigger delay / RR, not wrapped; shape (N,)."""
        return self.trigger_delay_ms / self.rr_ms

    def frame(self) -> pd.DataFrame:
        """Return the samples as a table with the columns of the file format, in its order."""
        columns = (
            self.phase_index,
            self.trigger_delay_ms,
            self.rr_ms,
            self.repeat,
            self.sample,
            self.speed_m_s,
            self.fit_r2,
            self.status,
        )
        return pd.DataFrame(dict(zip(COLUMNS, columns, strict=True)))
