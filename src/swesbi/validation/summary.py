"""What `validate` prints of a cohort that can be used."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from swesbi.recording.observation import Observation
from swesbi.validation.cohort import CohortReport

HEADER: Final = (
    "subject",
    "phases",
    "accepted",
    "rejected",
    "SE of c_s",
    "largest",
    "repeats",
    "samples",
    "E (kPa)",
    "rejected, by reason",
)
LEGEND: Final = (
    "phases: measured of gated. SE of c_s: standard error of a phase's mean shear-wave speed, median and\n"
    "largest. repeats, samples: relative standard deviation between repeats, and between samples of one.\n"
    "E: apparent Young's modulus of the measured phases, lowest to highest."
)


def summary(report: CohortReport) -> str:
    """Return a table with one line a subject, and what its columns mean."""
    rows = [HEADER, *(_row(subject.observation) for subject in report.subjects)]
    return "\n".join([*_aligned(rows), "", LEGEND])


def _row(observed: Observation) -> tuple[str, ...]:
    relative = (observed.speed_se_m_s / observed.speed_m_s)[observed.measured]
    stiffness = observed.stiffness_kpa[observed.measured]
    reasons = ", ".join(f"{reason} {count}" for reason, count in observed.rejected.items() if count)
    return (
        observed.subject,
        f"{int(observed.measured.sum())}/{len(observed.phase)}",
        str(int(observed.samples_accepted.sum())),
        str(int(observed.samples_rejected.sum())),
        f"{float(np.median(relative)):.1%}",
        f"{float(relative.max()):.1%}",
        f"{observed.noise.repeat_fraction:.1%}",
        f"{observed.noise.sample_fraction:.1%}",
        f"{stiffness.min():.1f}-{stiffness.max():.1f}",
        reasons or "none",
    )


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Pad the cells: the first and the last column to the left, numbers to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for first, *middle, last in rows:
        numbers = [cell.rjust(width) for cell, width in zip(middle, widths[1:-1], strict=True)]
        lines.append("  ".join([first.ljust(widths[0]), *numbers, last]))
    return lines
