"""Writing the virtual cohort in the format of real recordings, with the truth apart, and its picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.recording.columns import COLUMNS, SPEED
from swesbi.recording.samples import Samples
from swesbi.recording.settings import RecordingSettings
from swesbi.virtual_cohort.acquisition import record
from swesbi.virtual_cohort.clinical import measure
from swesbi.virtual_cohort.noise_levels import NOISE_LEVELS, noise_levels
from swesbi.virtual_cohort.readme import (
    LATE_DIASTOLIC_SPEED_M_S,
    PEAK_SPEED_M_S,
    curve_table,
    phase_medians,
    readme,
    subject_table,
    truth_table,
)
from swesbi.virtual_cohort.volunteers import LATE_DIASTOLE, VOLUNTEERS, Volunteer, simulate_truth

SAMPLE_COLOUR = "#9aa7b5"
MEDIAN_COLOUR = "#0b3c6f"
FAILED_COLOUR = "#d55e00"
PUBLISHED_COLOUR = "#009e73"
TOP_M_S = 7.2
WHOLE: Final = {"trigger_delay_ms": np.int64, "rr_ms": np.int64}  # rounded to the millisecond when acquired
ORIGIN: Final = "virtual volunteers, simulated by swesbi.virtual_cohort"
RECORDING: Final = """\
# How the recordings of this cohort were made
origin: {origin}; not measured on people
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
  repeats_are: sweeps
  samples_per_repeat: 12
density_kg_m3: 1000.0
sources:
  protocol: paper, Sec. 2.1
  speeds: see README.md
"""


def draw_recordings(volunteers: Sequence[Volunteer], recordings: Sequence[Samples]) -> Figure:
    """Draw every successful sample, the phase medians, the share that failed, and published ranges."""
    figure, axes = plt.subplots(2, 4, figsize=(12.5, 6.0), sharex=True, sharey=True, layout="constrained")
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
    figure.suptitle("Raw recordings of the virtual volunteers", fontsize=12)
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


def write_cohort(folder: Path, seed: int) -> None:
    """Write contexts, recordings, truth, picture and README of the volunteers into ``folder``.

    If ``acquisition_seeds.csv`` or ``noise_levels.csv`` lies there, the README shows it.
    """
    truths = [simulate_truth(volunteer) for volunteer in VOLUNTEERS]
    recordings = [record(truth, seed) for truth in truths]
    measures = [measure(truth, seed) for truth in truths]
    write_recordings(
        folder, {t.volunteer.context.subject: own for t, own in zip(truths, recordings, strict=True)}
    )
    write_csv(folder / "subjects.csv", subject_table(truths, measures))
    write_csv(folder / "truth.csv", truth_table(truths))
    write_csv(folder / "truth_curves.csv", curve_table(truths), "%.4f")
    write_text(folder / "recording.yaml", RECORDING.format(origin=ORIGIN, seed=seed))
    seeds, levels = (stored_table(folder / name) for name in ("acquisition_seeds.csv", NOISE_LEVELS))
    write_text(folder / "README.md", readme(truths, recordings, measures, seed, seeds, levels))
    _write_picture(folder / "recordings.png", recordings)


def write_recordings(folder: Path, recordings: Mapping[str, Samples]) -> None:
    """Write the raw samples of each subject into the cohort's folder, as CSV."""
    (folder / "swe").mkdir(parents=True, exist_ok=True)
    for subject, samples in recordings.items():
        write_csv(folder / "swe" / f"{subject}.csv", samples_table(samples).astype(WHOLE))


def samples_table(samples: Samples) -> pd.DataFrame:
    """Return the samples of a recording with the columns of its file, in their order."""
    values = {name: getattr(samples, "speed_m_s" if name == SPEED else name) for name in COLUMNS}
    return pd.DataFrame(values)


def write_noise_levels(folder: Path, recording: RecordingSettings, grid_points: int) -> None:
    """Measure what noise of each level leaves, and write the table that the README shows.

    Args:
        folder: The cohort's folder.
        recording: Quality control of the recordings.
        grid_points: Size of the analysis grid.
    """
    folder.mkdir(parents=True, exist_ok=True)
    truths = [simulate_truth(volunteer) for volunteer in VOLUNTEERS]
    write_csv(folder / NOISE_LEVELS, noise_levels(truths, recording, grid_points), "%.4g")


def stored_table(path: Path) -> pd.DataFrame | None:
    """Read a table that a README shows, cell by cell as it is written; None where there is none."""
    return pd.read_csv(path, dtype=str, keep_default_na=False) if path.is_file() else None


def write_csv(path: Path, table: pd.DataFrame, float_format: str | None = None) -> None:
    """Write a table with one kind of line ends on every machine."""
    table.to_csv(path, index=False, lineterminator="\n", float_format=float_format)


def write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8, with one kind of line ends on every machine."""
    path.write_text(text, encoding="utf-8", newline="\n")


def _write_picture(path: Path, recordings: Sequence[Samples]) -> None:
    with plt.style.context("default"):
        figure = draw_recordings(VOLUNTEERS, recordings)
        figure.savefig(path, dpi=130, metadata={"Software": None})
        plt.close(figure)
