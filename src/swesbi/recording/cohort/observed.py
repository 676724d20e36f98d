"""Raw recordings, by whoever asks, become observed curves by quality control, and their repeats the noise."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from swesbi.artefacts import UnfitError
from swesbi.base.arrays import IntArray
from swesbi.context import Context
from swesbi.recording.cohort.clinical import ClinicalMeasures, ClinicalRow
from swesbi.recording.cohort.files import find_recording
from swesbi.recording.cohort.recording_file import Description, read_recording_file
from swesbi.recording.copies import twin_refused, twins
from swesbi.recording.ingest import ingest, ingest_pushes
from swesbi.recording.noise.cohort import CohortNoise, GroupNoise, fit_cohort
from swesbi.recording.noise.components import RepeatLevels
from swesbi.recording.noise.sweeps import NOT_CROSSED, ONE_NUMBER, SweepLevels, levels_by
from swesbi.recording.observation import Contexts, Observation
from swesbi.recording.problems import Problem, refusal
from swesbi.recording.quality import oddities, phases_left_out, push_quality, rejection
from swesbi.recording.reader import read_samples, samples_in
from swesbi.recording.samples import ACCEPTED, Samples
from swesbi.recording.settings import ContextRow, NoiseSettings, RecordingSettings, Repeats
from swesbi.recording.tables.files import open_table
from swesbi.recording.tables.layout import TableLayout
from swesbi.recording.tables.table import Table

LOGGER = logging.getLogger("swesbi")


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


def observed_curve(
    table: Path,
    *,
    context: ContextRow,
    clinical_row: ClinicalRow,
    recording: RecordingSettings,
    grid_points: int,
    layout: TableLayout,
) -> Observation:
    """Read a subject's recording: quality control, mean speed at each phase, E = 3 rho c^2."""
    samples = read_samples(table, recording.phases, recording.density_kg_m3, layout, context.subject)
    observed = ingest(samples, context.to_context(), recording, grid_points, clinical_row.to_measures())
    LOGGER.info("%s", _account(observed))
    for sentence in phases_left_out(samples, recording):
        LOGGER.warning("subject %s: %s", context.subject, sentence)
    return observed


def _account(observed: Observation) -> str:
    rejected = ", ".join(f"{reason} {count}" for reason, count in observed.rejected.items() if count)
    return (
        f"subject {observed.subject}: {int(observed.measured.sum())} of {len(observed.phase)} phases, "
        f"{int(observed.samples_accepted.sum())} samples accepted; rejected: {rejected or 'none'}; "
        f"noise {observed.noise.repeat_fraction:.1%} between repeats, "
        f"{observed.noise.sample_fraction:.1%} between samples"
    )


class OfCohort(NamedTuple):
    """What the recordings of a cohort have in common: the noise of their speeds, and the contexts."""

    noise: CohortNoise
    contexts: Contexts


def cohort_noise(
    tables: tuple[Path, ...],
    observations: tuple[Observation, ...],
    protocol: Path,
    *,
    recording: RecordingSettings,
    layout: TableLayout,
    noise: NoiseSettings,
    noise_groups: dict[str, str],
) -> OfCohort:
    """Fit the mixed model to the accepted samples of all recordings, and put the contexts together.

    Raw ``tables`` are in the order of their observed curves, which name the subjects; ``noise_groups`` has
    the group of each subject whose errors are estimated apart. ``protocol`` is the cohort's
    ``recording.yaml``, which says whether repeats are sweeps.

    Raises:
        ArtefactError: An observed curve was not made of its recording under these settings.
        ValueError: A component cannot be estimated from the recordings.
    """
    repeats = read_recording_file(protocol.parent).protocol.repeats_are
    levels = {
        observed.subject: _levels(table, observed, repeats, recording, layout)
        for table, observed in zip(tables, observations, strict=True)
    }
    fitted = fit_cohort(levels, noise_groups, noise.interval)
    for name, group in fitted.groups.items():
        LOGGER.info("%s", _account_of_noise(name, group))
    return OfCohort(fitted, Contexts(tuple(observed.context for observed in observations)))


def _levels(
    table: Path, observed: Observation, repeats: Repeats, recording: RecordingSettings, layout: TableLayout
) -> RepeatLevels:
    samples = read_samples(table, recording.phases, recording.density_kg_m3, layout, observed.subject)
    accepted = rejection(samples, recording) == ACCEPTED
    if int(accepted.sum()) != int(observed.samples_accepted.sum()):
        raise UnfitError(
            "tables",
            f"{int(accepted.sum())} samples of {table} are accepted, but the observed curve of subject "
            f"{observed.subject} has {int(observed.samples_accepted.sum())}; delete the curve and rerun",
        )
    return levels_by(repeats, samples, accepted)


def _account_of_noise(name: str, noise: GroupNoise) -> str:
    parts = [
        f"{part.fraction:.2%} between {of}s ({part.low:.2%} to {part.high:.2%})"
        for of, part in noise.pooled.parts.items()
    ]
    return (
        f"noise of {len(noise.by_subject)} recordings ({name}): {', '.join(parts)}; the same in all: p = "
        f"{noise.homogeneity_p:.2g}"
    )
