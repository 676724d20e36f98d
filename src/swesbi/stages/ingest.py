"""Stage: the raw recording of one subject becomes its observed curve."""

from __future__ import annotations

import logging
from pathlib import Path

from swesbi.artefacts import save, to_groups
from swesbi.observation.settings import MeasurementSettings
from swesbi.recording.dataset import KIND
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.recording.reader import read_samples
from swesbi.recording.settings import ContextRow, RecordingSettings
from swesbi.settings import Settings
from swesbi.stages.origin import Origin

LOGGER = logging.getLogger("swesbi")


class IngestStageSettings(Settings):
    """What an observed curve depends on beside the recording; the context is the subject's own row."""

    context: ContextRow
    recording: RecordingSettings
    measurement: MeasurementSettings


def run(*, recording: Path, observation: Path, settings: IngestStageSettings, origin: Origin) -> None:
    """Read ``swe/<subject>.csv`` or ``.mat`` and write the observed curve.

    Raises:
        RecordingError: The recording is malformed or too incomplete.
    """
    samples = read_samples(recording, settings.recording.phases, settings.recording.density_kg_m3)
    observed = ingest(
        samples, settings.context.to_context(), settings.recording, settings.measurement.grid_points
    )
    save(observation, to_groups(observed), origin.provenance(KIND, settings))
    LOGGER.info("%s", _account(observed))


def _account(observed: Observation) -> str:
    rejected = ", ".join(f"{reason} {count}" for reason, count in observed.rejected.items() if count)
    return (
        f"subject {observed.subject}: {int(observed.measured.sum())} of {len(observed.phase)} phases, "
        f"{int(observed.samples_accepted.sum())} samples accepted; rejected: {rejected or 'none'}; "
        f"noise {observed.noise.repeat_fraction:.1%} between repeats, "
        f"{observed.noise.sample_fraction:.1%} between samples"
    )
