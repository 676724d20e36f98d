"""Raw recordings become observed curves; the noise of the cohort; the passive baseline of each subject."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from swesbi.answers.settings import IngestSettings
from swesbi.artefacts import ArtefactError, Origin, save, to_dataset, to_groups
from swesbi.base.settings import Settings
from swesbi.heart.settings import ForwardModelSettings
from swesbi.measurement.likelihood import reference_beat
from swesbi.measurement.operator import KIND as PASSIVE
from swesbi.measurement.operator import calibrate_passive
from swesbi.measurement.settings import MeasurementSettings, PassiveSettings
from swesbi.prior import PriorSettings
from swesbi.recording.cohort.recording_file import read_recording_file
from swesbi.recording.ingest import ingest as ingest_recording
from swesbi.recording.noise.cohort import KIND as NOISE
from swesbi.recording.noise.cohort import GroupNoise, fit_cohort
from swesbi.recording.noise.cohort import to_dataset as noise_to_dataset
from swesbi.recording.noise.components import RepeatLevels
from swesbi.recording.noise.sweeps import levels_by
from swesbi.recording.observation import CONTEXTS, Observation, contexts_dataset, read_observation
from swesbi.recording.observation import KIND as OBSERVATION
from swesbi.recording.quality import phases_left_out, rejection
from swesbi.recording.reader import read_samples
from swesbi.recording.samples import ACCEPTED
from swesbi.recording.settings import NoiseSettings, RecordingSettings, Repeats
from swesbi.recording.tables.layout import TableLayout

LOGGER = logging.getLogger("swesbi")


def ingest(*, recording: Path, observation: Path, settings: IngestSettings, origin: Origin) -> None:
    """Read the recording of ``origin.subject`` and write the observed curve.

    Raises:
        RecordingError: The recording is malformed or too incomplete.
    """
    quality, subject = settings.recording, settings.context.subject
    samples = read_samples(recording, quality.phases, quality.density_kg_m3, settings.layout, subject)
    observed = ingest_recording(
        samples,
        settings.context.to_context(),
        settings.recording,
        settings.measurement.grid_points,
        settings.clinical.to_measures(),
    )
    save(observation, to_groups(observed), origin.provenance(OBSERVATION, settings))
    LOGGER.info("%s", _account(observed))
    for sentence in phases_left_out(samples, quality):
        LOGGER.warning("subject %s: %s", subject, sentence)


def _account(observed: Observation) -> str:
    rejected = ", ".join(f"{reason} {count}" for reason, count in observed.rejected.items() if count)
    return (
        f"subject {observed.subject}: {int(observed.measured.sum())} of {len(observed.phase)} phases, "
        f"{int(observed.samples_accepted.sum())} samples accepted; rejected: {rejected or 'none'}; "
        f"noise {observed.noise.repeat_fraction:.1%} between repeats, "
        f"{observed.noise.sample_fraction:.1%} between samples"
    )


class NoiseStageSettings(Settings):
    """What the components depend on: accepted samples, groups estimated apart (by subject), the interval."""

    recording: RecordingSettings
    layout: TableLayout
    noise: NoiseSettings
    noise_groups: dict[str, str]


def noise(
    *,
    recordings: Sequence[Path],
    observations: Sequence[Path],
    protocol: Path,
    noise: Path,
    contexts: Path,
    settings: NoiseStageSettings,
    origin: Origin,
) -> None:
    """Fit the mixed model to the accepted samples of all recordings.

    It reads every observed curve, and so also puts the contexts of the cohort together.

    Args:
        recordings: Raw recordings, one a subject.
        observations: Their observed curves, in the same order; they name the subjects.
        protocol: ``recording.yaml`` of the cohort, which says whether repeats are sweeps.
        noise: Output.
        contexts: Output: the contexts of the subjects.

    Raises:
        ArtefactError: An observed curve was not made of its recording under these settings.
        RecordingError: A recording, or what is said of the repeats, cannot be read.
        ValueError: A component cannot be estimated from the recordings.
    """
    observed = [read_observation(path) for path in observations]
    repeats = read_recording_file(protocol.parent).protocol.repeats_are
    levels = {
        observation.subject: _levels(recording, observation, repeats, settings)
        for recording, observation in zip(recordings, observed, strict=True)
    }
    fitted = fit_cohort(levels, settings.noise_groups, settings.noise.interval)
    save(noise, noise_to_dataset(fitted), origin.provenance(NOISE, settings))
    together = contexts_dataset([observation.context for observation in observed])
    save(contexts, together, origin.provenance(CONTEXTS, settings))
    for name, group in fitted.groups.items():
        LOGGER.info("%s", _account_of_noise(name, group))


def _levels(
    recording: Path, observation: Observation, repeats: Repeats, settings: NoiseStageSettings
) -> RepeatLevels:
    quality, subject = settings.recording, observation.subject
    samples = read_samples(recording, quality.phases, quality.density_kg_m3, settings.layout, subject)
    accepted = rejection(samples, quality) == ACCEPTED
    if int(accepted.sum()) != int(observation.samples_accepted.sum()):
        raise ArtefactError(
            f"{recording}: {int(accepted.sum())} samples are accepted, but the observed curve of subject "
            f"{observation.subject} has {int(observation.samples_accepted.sum())}; delete the curve and rerun"
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


class PassiveStageSettings(Settings):
    """What the passive baseline depends on; the reference beat runs at the prior's log-centre."""

    forward_model: ForwardModelSettings
    prior: PriorSettings
    passive: PassiveSettings
    measurement: MeasurementSettings


def passive(*, observation: Path, passive: Path, settings: PassiveStageSettings, origin: Origin) -> None:
    """Calibrate and write the passive baseline of the subject whose observed curve is given.

    Raises:
        PassiveCalibrationError: It cannot be calibrated.
    """
    observed = read_observation(observation)
    reference = reference_beat(observed.context, settings.prior, settings.forward_model)
    baseline = calibrate_passive(observed, reference, settings.passive, settings.measurement)
    save(passive, to_dataset(baseline), origin.provenance(PASSIVE, settings))
    LOGGER.info(
        "subject %s: passive scale %.2f kPa; late diastole %.2f kPa, %.2f of it active in the reference beat",
        observed.subject,
        baseline.scale_kpa,
        baseline.late_diastolic_observed_kpa,
        baseline.late_diastolic_active_kpa,
    )
