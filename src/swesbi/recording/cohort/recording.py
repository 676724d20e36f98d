"""One recording as it is read, by whoever asks: samples or pushes, and what quality control makes of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from swesbi.base.arrays import IntArray
from swesbi.context import Context
from swesbi.recording.cohort.clinical import ClinicalMeasures
from swesbi.recording.cohort.files import find_recording
from swesbi.recording.cohort.recording_file import Description
from swesbi.recording.copies import twin_refused, twins
from swesbi.recording.ingest import ingest
from swesbi.recording.noise.components import RepeatLevels
from swesbi.recording.noise.sweeps import NOT_CROSSED, ONE_NUMBER, SweepLevels, levels_by
from swesbi.recording.observation import Observation
from swesbi.recording.problems import Problem, refusal
from swesbi.recording.pushes import ingest_pushes
from swesbi.recording.quality import oddities, phases_left_out, push_quality, rejection
from swesbi.recording.reader import samples_in
from swesbi.recording.samples import ACCEPTED, Samples
from swesbi.recording.tables.files import open_table
from swesbi.recording.tables.table import Table


@dataclass(frozen=True)
class UsableRecording:
    """One subject whose recording of N samples can be used, with its observed curve.

    ``verdict`` (N,) has the index of the reason for which each sample is rejected, -1 where accepted. By
    ``levels`` the noise is estimated; None of pushes. ``left_out`` says what is left out as a whole, or odd:
    phases, columns, clipped speeds. Where ``copies_allowed``, another recording may have the same speeds.
    """

    samples: Samples
    verdict: IntArray
    observation: Observation
    levels: RepeatLevels | None
    left_out: tuple[str, ...] = ()
    copies_allowed: bool = False


def read_raw(cohort: Path, subject: str, said: Description) -> Samples:
    """Read the recording of a subject."""
    layout = said.file.layout
    path = find_recording(cohort, subject, layout.table.file)
    return raw_of(open_table(path, layout), said, subject)


def raw_of(table: Table, said: Description, subject: str = "") -> Samples:
    """Read a table as it stands in its file or in memory; as :func:`read_raw`."""
    settings = said.settings
    return samples_in(
        table, settings.phases, settings.density_kg_m3, said.file.layout, subject, said.phases_source
    )


def ingested(
    raw: Samples,
    said: Description,
    context: Context,
    clinical: ClinicalMeasures,
    grid_points: int,
) -> UsableRecording:
    """Return what quality control makes of a recording."""
    settings, file, noted = said.settings, said.file, oddities(raw, said.settings)
    copies = file.table.copies_allowed
    if not raw.is_gated:
        pushes = ingest_pushes(raw, context, settings, file.noise, clinical)
        quality = push_quality(raw, settings, file.noise)
        return UsableRecording(raw, quality.verdict, pushes, None, (*quality.left_out, *noted), copies)
    observation, verdict = ingest(raw, context, settings, grid_points, clinical), rejection(raw, settings)
    levels = levels_by(file.protocol.repeats_are, raw, verdict == ACCEPTED)
    if isinstance(levels, SweepLevels) and not levels.is_crossed:
        raise refusal(raw.source, NOT_CROSSED, ONE_NUMBER, column="repeat")
    return UsableRecording(
        raw, verdict, observation, levels, (*phases_left_out(raw, settings), *noted), copies
    )


def twins_among(recordings: Mapping[str, UsableRecording]) -> dict[str, Problem]:
    """Return what is wrong with those recordings of a folder that are the same, unless that is declared."""
    compared = {name: one for name, one in recordings.items() if not one.copies_allowed}
    found = twins({name: one.samples.speed_m_s for name, one in compared.items()})
    return {name: twin_refused(compared[name].samples.source, other) for name, other in found.items()}
