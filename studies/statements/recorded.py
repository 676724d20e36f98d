"""Volunteers recorded again: under another acquisition seed, or with the errors that a laboratory has."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from studies.statements.settings import Reading
from swesbi.artefacts import ArtefactError
from swesbi.base.settings import Settings
from swesbi.context import Context
from swesbi.heart.settings import ForwardModelSettings
from swesbi.measurement.likelihood import MeasuredSubject, reference_beat
from swesbi.measurement.operator import calibrate_passive
from swesbi.measurement.settings import MeasurementSettings, PassiveSettings
from swesbi.prior import PriorSettings
from swesbi.recording.ingest import ingest
from swesbi.recording.settings import ACQUISITION_SEED, AcquisitionSettings, RecordingSettings
from swesbi.virtual.volunteers import VOLUNTEERS, Volunteer, record, simulate_truth

ERRORS: Final = (
    "samples_per_repeat",
    "sample_sd_fraction",
    "repeat_sd_fraction",
    "sweep_fraction",
    "scale_fraction",
)
"""What a laboratory's acquisition has of its own; failures and outliers are the volunteer's."""


class RecordedSettings(Settings):
    """How a recording is made and ingested, and the passive baseline calibrated on it."""

    recording: RecordingSettings
    measurement: MeasurementSettings
    passive: PassiveSettings
    reference_prior: PriorSettings
    forward_model: ForwardModelSettings
    acquisition: AcquisitionSettings


@dataclass(frozen=True)
class Rerecorded:
    """A subject as the networks know it, and as it is recorded now."""

    trained: MeasuredSubject
    subject: MeasuredSubject

    @property
    def name(self) -> str:
        """The subject's name."""
        return self.subject.observation.subject


def rerecorded(
    trained: MeasuredSubject, acquisition_seed: int, reading: Reading, settings: RecordedSettings
) -> Rerecorded:
    """Record a volunteer again; under the shipped seed and with its own errors it is the shipped recording.

    A new recording that fails quality control, or admits no positive passive scale, is refused.
    """
    if acquisition_seed == ACQUISITION_SEED and reading.noise == "own":
        return Rerecorded(trained, trained)
    context, measurement = trained.observation.context, settings.measurement
    volunteer = volunteer_of(context)
    if reading.noise == "laboratory":
        errors = {name: getattr(settings.acquisition, name) for name in ERRORS}
        volunteer = replace(volunteer, acquisition=volunteer.acquisition.model_copy(update=errors))
    samples = record(simulate_truth(volunteer), acquisition_seed)
    observed = ingest(samples, context, settings.recording, measurement.grid_points)
    reference = reference_beat(context, settings.reference_prior, settings.forward_model)
    passive = calibrate_passive(observed, reference, settings.passive, measurement)
    return Rerecorded(trained, MeasuredSubject(observed, passive, measurement))


def volunteer_of(context: Context) -> Volunteer:
    """Return the virtual volunteer with this context."""
    for volunteer in VOLUNTEERS:
        if volunteer.context == context:
            return volunteer
    raise ArtefactError(
        f"subject {context.subject}: its context is that of no virtual volunteer; only virtual volunteers "
        "can be recorded again"
    )
