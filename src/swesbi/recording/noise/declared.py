"""The errors of the speeds of a free-running recording, which has no repeats to tell them from.

They stand in the file, or follow from the quality of its fits, or are declared: then the declared coefficient
of variation is not assumed but has a log-normal prior, and is integrated out of the likelihood
(``measurement.instants``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.recording.problems import refusal
from swesbi.recording.samples import Samples
from swesbi.recording.settings import NoiseDeclaration
from swesbi.recording.tables.columns import STANDARD_ERROR

NoiseSource = Literal["se_m_s", "fit_r2", "declared"]
DECLARE: Final = (
    "add a column se_m_s; or declare in recording.yaml, or in swe/<subject>.yaml, "
    "`noise: { cv_fraction: 0.1, cv_log_sd: 0.3 }`, or `noise: { fit_points: 12 }` where each speed is the "
    "slope of a line through so many points and fit_r2 its R2"
)


@dataclass(frozen=True)
class DeclaredNoise:
    """Errors of n speeds, relative (n,), where declared their prior median, and what they are computed from.

    ``log_sd`` is the standard deviation of the logarithm of what all are multiplied by; 0 where they are
    known.
    """

    relative_se: FloatArray
    log_sd: float
    source: NoiseSource


def declared_noise(samples: Samples, accepted: BoolArray, declared: NoiseDeclaration) -> DeclaredNoise:
    """Return the errors of the accepted speeds: of the file before anything that is declared.

    The slope of a line through n points has, by least squares, the relative standard error
    sqrt((1 / R2 - 1) / (n - 2)): its t statistic is sqrt((n - 2) R2 / (1 - R2)) (Draper and Smith, Applied
    Regression Analysis, 1998, Ch. 6). A speed is that slope or its inverse, to first order with the same one.
    Where nothing tells the errors, or that of an accepted push is missing, the recording is refused.
    """
    count = int(accepted.sum())
    if samples.se_m_s is not None:
        relative, empty = (
            (samples.se_m_s / samples.speed_m_s)[accepted],
            "is empty beside a speed that is accepted",
        )
        _check_all(samples, accepted, relative, samples.se_m_s, STANDARD_ERROR, empty)
        return DeclaredNoise(relative, 0.0, "se_m_s")
    if declared.fit_points is not None:
        every = np.full(len(accepted), np.nan) if samples.fit_r2 is None else samples.fit_r2
        r2 = every[accepted]
        with np.errstate(divide="ignore", invalid="ignore"):
            relative = np.sqrt((1.0 / r2 - 1.0) / (declared.fit_points - 2))
        wrong = np.where((r2 > 0.0) & (r2 < 1.0), relative, np.nan)
        _check_all(samples, accepted, wrong, every, "fit_r2", "tells no error: it must lie between 0 and 1")
        return DeclaredNoise(relative, 0.0, "fit_r2")
    if declared.cv_fraction is not None and declared.cv_log_sd is not None:
        return DeclaredNoise(np.full(count, declared.cv_fraction), declared.cv_log_sd, "declared")
    reason = "has no repeats at a phase, and nothing says how large the errors of its speeds are"
    raise refusal(samples.source, reason, DECLARE)


def _check_all(
    samples: Samples,
    accepted: BoolArray,
    relative: FloatArray,
    values: FloatArray,
    column: str,
    reason: str,
) -> None:
    """Refuse an accepted push without a usable error; the first is named by its instant."""
    missing = np.flatnonzero(np.isnan(relative))
    if missing.size:
        index = np.flatnonzero(accepted)[missing[0]]
        raise refusal(
            samples.source,
            f"of the push at time_ms {samples.time_ms[index]:g} ({missing.size} of {accepted.sum()} pushes) "
            f"{reason}",
            "give it, or another status than ok",
            column=column,
            value="" if np.isnan(values[index]) else f"{values[index]:g}",
        )
