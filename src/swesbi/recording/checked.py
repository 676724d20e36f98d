"""One recording as it is read, by whoever asks: samples or pushes, and what quality control makes of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from swesbi.base.arrays import IntArray
from swesbi.context import Context
from swesbi.recording.clinical import ClinicalMeasures
from swesbi.recording.cohort import find_recording
from swesbi.recording.components import RepeatLevels
from swesbi.recording.foreign import is_free
from swesbi.recording.free_observation import FreeObservation, ingest_free
from swesbi.recording.free_quality import push_quality
from swesbi.recording.free_samples import FreeSamples, read_free_samples
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.recording.problems import Problem, RecordingError
from swesbi.recording.protocol import Said
from swesbi.recording.quality import phases_left_out, rejection
from swesbi.recording.reader import read_samples
from swesbi.recording.samples import ACCEPTED, Samples
from swesbi.recording.sweeps import NOT_CROSSED, ONE_NUMBER, SweepLevels, is_crossed, levels_by


@dataclass(frozen=True)
class Checked:
    """One subject whose recording can be used.

    Attributes:
        samples: The raw recording, N samples.
        verdict: Index of the reason for which each sample is rejected, -1 where accepted; shape (N,).
        observation: The observed curve.
        levels: Its repeats, by which the noise is estimated.
        left_out: The phases that are left out as a whole, a sentence each.
    """

    samples: Samples
    verdict: IntArray
    observation: Observation
    levels: RepeatLevels
    left_out: tuple[str, ...] = ()


@dataclass(frozen=True)
class CheckedFree:
    """One subject whose free-running recording can be used; as :class:`Checked`, with pushes for phases."""

    samples: FreeSamples
    verdict: IntArray
    observation: FreeObservation
    left_out: tuple[str, ...] = ()


def read_raw(cohort: Path, subject: str, said: Said) -> Samples | FreeSamples:
    """Read the recording of a subject: samples where it is gated, else pushes.

    Raises:
        RecordingError: It is malformed.
    """
    layout, density = said.protocol.layout, said.settings.density_kg_m3
    path = find_recording(cohort, subject, layout.table.file)
    if is_free(path, layout):
        return read_free_samples(path, density, layout, subject)
    return read_samples(path, said.settings.phases, density, layout, subject)


def ingested(
    raw: Samples | FreeSamples, said: Said, context: Context, clinical: ClinicalMeasures, grid_points: int
) -> Checked | CheckedFree:
    """Return what quality control makes of a recording.

    Args:
        raw: Of :func:`read_raw`.
        said: How it was made.
        context: Whose heart it is.
        clinical: What else was measured.
        grid_points: Number of points of the analysis grid.

    Raises:
        RecordingError: It is too incomplete, or nothing tells its errors.
    """
    settings, protocol = said.settings, said.protocol
    if isinstance(raw, FreeSamples):
        observed = ingest_free(raw, context, settings, protocol.noise, clinical)
        quality = push_quality(raw, settings, protocol.noise)
        return CheckedFree(raw, quality.verdict, observed, quality.left_out)
    observation, verdict = ingest(raw, context, settings, grid_points, clinical), rejection(raw, settings)
    levels = levels_by(protocol.repeats_are, raw, verdict == ACCEPTED)
    if isinstance(levels, SweepLevels) and not is_crossed(levels):
        raise RecordingError(Problem(raw.source, NOT_CROSSED, ONE_NUMBER, column="repeat"))
    return Checked(raw, verdict, observation, levels, phases_left_out(raw, settings))
