"""New recordings of a virtual volunteer, made by its richer physiology, to measure the power of the tests."""

from __future__ import annotations

import logging

from swesbi.context import Context
from swesbi.recording.ingest import ingest
from swesbi.recording.problems import RecordingError
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.seeds import integer_seed
from swesbi.speed_model.recording import SpeedRecording, measured_speeds
from swesbi.virtual_cohort.record import record
from swesbi.virtual_cohort.truth import simulate_truth
from swesbi.virtual_cohort.volunteers import VOLUNTEERS, Volunteer

LOGGER = logging.getLogger("swesbi")


def find_volunteer(context: Context) -> Volunteer | None:
    """Return the virtual volunteer with exactly this context; None for a subject of another cohort."""
    return next((volunteer for volunteer in VOLUNTEERS if volunteer.context == context), None)


def volunteer_recordings(
    volunteer: Volunteer,
    count: int,
    settings: RecordingSettings,
    grid_points: int,
    noise: NoiseComponents,
    seed: int,
) -> tuple[tuple[SpeedRecording, ...], int]:
    """Record a volunteer ``count`` times with other acquisition noise, each time ingested anew.

    Returns:
        The recordings, and how many ingestion refused.
    """
    truth = simulate_truth(volunteer)
    kept = []
    for index in range(count):
        samples = record(truth, integer_seed(seed, "misspecification", "volunteer", index))
        try:
            observed = ingest(samples, volunteer.context, settings, grid_points)
        except RecordingError as error:
            LOGGER.info("volunteer %s, recording %d refused: %s", volunteer.context.subject, index, error)
        else:
            kept.append(measured_speeds(observed, noise))
    return tuple(kept), count - len(kept)
