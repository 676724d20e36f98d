"""The picture of the six virtual recordings."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.recording.samples import Samples
from swesbi.virtual_cohort.tables import LATE_DIASTOLIC_SPEED_M_S, PEAK_SPEED_M_S, phase_medians
from swesbi.virtual_cohort.volunteers import LATE_DIASTOLE, Volunteer

SAMPLE_COLOUR = "#9aa7b5"
MEDIAN_COLOUR = "#0b3c6f"
FAILED_COLOUR = "#d55e00"
PUBLISHED_COLOUR = "#009e73"
TOP_M_S = 7.2


def draw_recordings(volunteers: Sequence[Volunteer], recordings: Sequence[Samples]) -> Figure:
    """Draw every successful sample, the phase medians, the share that failed, and published ranges."""
    figure, axes = plt.subplots(2, 3, figsize=(10.0, 6.0), sharex=True, sharey=True, layout="constrained")
    for axis, volunteer, samples in zip(axes.flat, volunteers, recordings, strict=True):
        _draw_recording(axis, samples)
        context = volunteer.context
        axis.set_title(
            f"{context.subject}: {context.sex}, {context.age_years:.0f} years, {context.hr_bpm:.0f} bpm",
            fontsize=10,
        )
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    for axis in axes[-1]:
        axis.set_xlabel("phase of the cardiac cycle, from the R peak", fontsize=9)
    for axis in axes[:, 0]:
        axis.set_ylabel("shear-wave speed $c_s$ (m/s)", fontsize=9)
    figure.suptitle("Raw recordings of the six virtual volunteers", fontsize=12)
    return figure


def _draw_recording(axis: Axes, samples: Samples) -> None:
    phase, median = phase_medians(samples)
    axis.fill_between(LATE_DIASTOLE, *LATE_DIASTOLIC_SPEED_M_S, color=PUBLISHED_COLOUR, alpha=0.35, lw=0)
    axis.fill_between(
        (0.3, 0.5), *PEAK_SPEED_M_S, color=PUBLISHED_COLOUR, alpha=0.15, lw=0, label="published range"
    )
    axis.plot(samples.beat_phase, samples.speed_m_s, ".", ms=2.5, color=SAMPLE_COLOUR, label="sample")
    axis.plot(phase, median, "o-", ms=3.5, lw=1.2, color=MEDIAN_COLOUR, label="median of a phase")
    attempted = np.bincount(samples.phase_index)
    failed = np.bincount(samples.phase_index, weights=np.isnan(samples.speed_m_s)) / attempted
    centre = np.bincount(samples.phase_index, weights=samples.beat_phase) / attempted
    axis.bar(centre, failed, width=0.025, color=FAILED_COLOUR, label="failed samples (bar of height 1: all)")
    axis.set(xlim=(0.0, 1.0), ylim=(0.0, TOP_M_S))
    axis.tick_params(labelsize=9)
