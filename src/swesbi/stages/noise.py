"""Stage: the variance components of the measured speeds, from the raw recordings of the whole cohort.

It reads every observed curve, and so also puts the contexts of the cohort together.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from swesbi.artefacts import ArtefactError, save
from swesbi.noise.cohort import CohortNoise, fit_noise
from swesbi.noise.dataset import KIND, to_dataset
from swesbi.noise.levels import RepeatLevels, repeat_levels
from swesbi.noise.settings import NoiseSettings
from swesbi.recording.dataset import CONTEXTS, contexts_dataset, read_observation
from swesbi.recording.observation import Observation
from swesbi.recording.quality import ACCEPTED, rejection
from swesbi.recording.reader import read_samples
from swesbi.recording.settings import RecordingSettings
from swesbi.settings import Settings
from swesbi.stages.origin import Origin

LOGGER = logging.getLogger("swesbi")


class NoiseStageSettings(Settings):
    """What the components depend on beside the recordings: which samples are accepted, and the interval."""

    recording: RecordingSettings
    noise: NoiseSettings


def run(
    *,
    recordings: Sequence[Path],
    observations: Sequence[Path],
    noise: Path,
    contexts: Path,
    settings: NoiseStageSettings,
    origin: Origin,
) -> None:
    """Fit the mixed model to the accepted samples of all recordings.

    Args:
        recordings: Raw recordings, one a subject.
        observations: Their observed curves, in the same order; they name the subjects.
        noise: Output.
        contexts: Output: the contexts of the subjects.
        settings: Quality control, as at ingestion.
        origin: Whose work this is.

    Raises:
        ArtefactError: An observed curve was not made of its recording under these settings.
        ValueError: A component cannot be told from the recordings.
    """
    observed = [read_observation(path) for path in observations]
    levels = {
        observation.subject: _levels(recording, observation, settings.recording)
        for recording, observation in zip(recordings, observed, strict=True)
    }
    found = fit_noise(levels, settings.noise.interval)
    save(noise, to_dataset(found), origin.provenance(KIND, settings))
    together = contexts_dataset([observation.context for observation in observed])
    save(contexts, together, origin.provenance(CONTEXTS, settings))
    LOGGER.info("%s", _account(found))


def _levels(recording: Path, observation: Observation, settings: RecordingSettings) -> RepeatLevels:
    samples = read_samples(recording, settings.phases, settings.density_kg_m3)
    accepted = rejection(samples, settings) == ACCEPTED
    if int(accepted.sum()) != int(observation.samples_accepted.sum()):
        raise ArtefactError(
            f"{recording}: {int(accepted.sum())} samples are accepted, but the observed curve of subject "
            f"{observation.subject} has {int(observation.samples_accepted.sum())}; delete the curve and rerun"
        )
    return repeat_levels(samples, accepted)


def _account(noise: CohortNoise) -> str:
    parts = [
        f"{part.fraction:.2%} between {name} ({part.low:.2%} to {part.high:.2%})"
        for name, part in (("repeats", noise.pooled.repeat), ("samples", noise.pooled.sample))
    ]
    return (
        f"noise of {len(noise.by_subject)} recordings: {', '.join(parts)}; the same in all: p = "
        f"{noise.homogeneity_p:.2g}"
    )
