"""Stage: the raw recordings of a batch of subjects become their observed curves, one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from swesbi.code_hash import stage_hash
from swesbi.observation.settings import MeasurementSettings
from swesbi.progress import Progress
from swesbi.recording.settings import ContextRow, RecordingSettings
from swesbi.settings import Settings
from swesbi.stages import ingest
from swesbi.stages.origin import Origin


class IngestBatchStageSettings(Settings):
    """What observed curves depend on beside the recordings; contexts in the order of the recordings."""

    contexts: tuple[ContextRow, ...]
    recording: RecordingSettings
    measurement: MeasurementSettings


def run(
    *,
    recordings: Sequence[Path],
    observations: Sequence[Path],
    settings: IngestBatchStageSettings,
    origin: Origin,
) -> None:
    """Write each observed curve exactly as the stage of one subject does, its provenance included.

    Args:
        recordings: Raw samples.
        observations: Output, in the order of the recordings.
        settings: Contexts, quality control and grid.
        origin: Seed of the study.

    Raises:
        RecordingError: A recording is malformed or too incomplete.
    """
    progress = Progress("ingestion", len(settings.contexts), unit="subject")
    code_hash = stage_hash(ingest.run.__module__, ingest.run.__name__)
    for row, recording, observation in zip(settings.contexts, recordings, observations, strict=True):
        own = ingest.IngestStageSettings(
            context=row, recording=settings.recording, measurement=settings.measurement
        )
        whose = replace(origin, subject=row.subject, code_hash=code_hash)
        ingest.run(recording=recording, observation=observation, settings=own, origin=whose)
        progress.step()
