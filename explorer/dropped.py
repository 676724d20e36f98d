"""Files dropped on the page: a gated recording and ``subjects.csv``, read and checked as the study's own."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from swesbi.context import CONTEXT, CONTEXT_BOUNDS, Context
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.recording.reader import MEASURED, REQUIRED, check_measured, samples_of
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.tables.csv_text import read_csv
from swesbi.recording.tables.layout import TEXTS

HEART: Final = ("hr_bpm", "lvedv_ml", "lvesv_ml", "ivsd_cm")
"""What the forward model takes, and what its beats are held against."""
GRID_POINTS: Final = 100  # of the curve through the phases, which only its checks look at


def dropped_recording(path: Path, context: Context, settings: RecordingSettings) -> Observation:
    """Read a gated recording in this project's own form and check it against the heart that it is of."""
    table = read_csv(path).using(REQUIRED, MEASURED, TEXTS)
    check_measured(table)
    samples = samples_of(table, settings.phases, settings.density_kg_m3)
    return ingest(samples, context, settings, GRID_POINTS)


def dropped_hearts(path: Path) -> dict[str, dict[str, float]]:
    """Read what ``subjects.csv`` says of each subject's heart, by the names in ``HEART``."""
    heart = [variable for variable in CONTEXT if variable.name in HEART]
    table = read_csv(path).using(("subject", *(variable.name for variable in heart)), (), TEXTS)
    table.unique(["subject"])
    columns = {}
    for variable in heart:
        low, high = CONTEXT_BOUNDS[variable.name]
        columns[variable.name] = table.number(variable.name, low, high, variable.remedy)
    table.finish()
    names = table.cells["subject"].tolist()
    return {
        name: {column: float(values[row]) for column, values in columns.items()}
        for row, name in enumerate(names)
    }
