"""The models of the cohort's recordings, read from its artefacts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from swesbi.noise.dataset import read_noise
from swesbi.recording.dataset import read_observation
from swesbi.recording.speed import NoiseComponents
from swesbi.speed_model.model import SpeedModel, SpeedModelSettings, speed_model
from swesbi.speed_model.recording import measured_speeds


def read_speed_model(observation: Path, noise: Path, settings: SpeedModelSettings) -> SpeedModel:
    """Read one recording and the cohort's noise, and build its model.

    Raises:
        ArtefactError: A file is no such artefact.
        ValueError: The reference beat does not become periodic.
    """
    return build_speed_model(observation, read_noise(noise).components, settings)


def build_speed_model(
    observation: Path, components: NoiseComponents, settings: SpeedModelSettings
) -> SpeedModel:
    """Read one recording, and build its model with this noise; errors as of ``read_speed_model``."""
    return speed_model(measured_speeds(read_observation(observation), components), settings)


def read_speed_models(
    observations: Sequence[Path], noise: Path, settings: SpeedModelSettings
) -> tuple[SpeedModel, ...]:
    """Read the models of several recordings, in the order given."""
    components = read_noise(noise).components
    return tuple(build_speed_model(path, components, settings) for path in observations)
