"""Writing the virtual trial in the format of real recordings, with the truth apart, and its picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from swesbi.virtual_cohort.files import RECORDING, write_csv, write_recordings, write_text
from swesbi.virtual_cohort.readme import phase_medians
from swesbi.virtual_trial.persons import TrialPerson, draw_trial
from swesbi.virtual_trial.readme import readme
from swesbi.virtual_trial.settings import AFTER, BEFORE, CONTROL
from swesbi.virtual_trial.source import TrialSource
from swesbi.virtual_trial.tables import subject_table, truth_table

ORIGIN: Final = "a virtual trial, simulated by swesbi.virtual_trial"
COLUMNS: Final = 6
COLOURS: Final = {BEFORE: "#0b3c6f", AFTER: "#d55e00"}
DIGITS: Final = "%.6g"


def write_trial(folder: Path, source: TrialSource) -> None:
    """Write contexts, recordings, truth, picture and README of the trial into ``folder``."""
    persons = draw_trial(source)
    truth = truth_table(persons)
    write_recordings(
        folder, {visit.context.subject: visit.samples for person in persons for visit in person.visits}
    )
    write_csv(folder / "subjects.csv", subject_table(persons))
    write_csv(folder / "truth.csv", truth, DIGITS)
    write_text(folder / "recording.yaml", RECORDING.format(origin=ORIGIN, seed=source.seed))
    write_text(folder / "README.md", readme(persons, truth, source))
    with plt.style.context("default"):
        figure = draw_trial_recordings(persons)
        figure.savefig(folder / "recordings.png", dpi=100, metadata={"Software": None})
        plt.close(figure)


def draw_trial_recordings(persons: Sequence[TrialPerson]) -> Figure:
    """Draw the phase medians of both visits, a panel a person, the control group first."""
    ordered = sorted(persons, key=lambda person: (person.group != CONTROL, person.name))
    rows = -(-len(ordered) // COLUMNS)
    figure, axes = plt.subplots(
        rows, COLUMNS, figsize=(12.5, 0.6 + 1.7 * rows), sharex=True, sharey=True, layout="constrained"
    )
    for axis in axes.flat[len(ordered) :]:
        axis.set_axis_off()
    for axis, person in zip(axes.flat, ordered, strict=False):
        for visit in person.visits:
            phase, speed = phase_medians(visit.samples)
            axis.plot(phase, speed, "o-", ms=2.5, lw=1.2, color=COLOURS[visit.visit], label=visit.visit)
        axis.set_title(f"{person.name}, {person.group}", fontsize=9)
        axis.set(xlim=(0.0, 1.0))
        axis.tick_params(labelsize=8)
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False, fontsize=9)
    for axis in axes[-1]:
        axis.set_xlabel("phase of the cycle", fontsize=9)
    for axis in axes[:, 0]:
        axis.set_ylabel("speed (m/s)", fontsize=9)
    figure.suptitle(
        "Recordings of the virtual trial: median shear-wave speed of each phase, from the R peak", fontsize=12
    )
    return figure
