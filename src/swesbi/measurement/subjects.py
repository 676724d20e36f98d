"""The subjects of a cohort as inference reads them from its artefacts: by features, or by speeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import ArtefactError, load
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, speed_model
from swesbi.measurement.operator import KIND as PASSIVE
from swesbi.measurement.operator import PassiveBaseline, read_passive, total_curves
from swesbi.measurement.settings import MeasurementSettings, SummarySettings
from swesbi.measurement.speeds import measured_speeds
from swesbi.measurement.summary import summarise
from swesbi.recording.noise import read_noise
from swesbi.recording.observation import Observation, read_observation
from swesbi.recording.speed import NoiseComponents

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class MeasuredSubject:
    """One subject's recording and passive baseline."""

    observation: Observation
    passive: PassiveBaseline

    def observed_features(self, summary: SummarySettings) -> FloatArray:
        """Return x_obs = S(E_obs) of shape (F,) (paper, Eq. 4)."""
        features: FloatArray = summarise(self.observation.curve_kpa[None], summary)[0]
        return features

    def simulated_features(
        self,
        cycle_phase: FloatArray,
        active_stiffness_kpa: FloatArray,
        measurement: MeasurementSettings,
        summary: SummarySettings,
    ) -> FloatArray:
        """Return x = S(E_sim) of shape (n, F), measured at the subject's phases (paper, Eqs. 3 and 4).

        Args:
            cycle_phase: (M,) phases of the simulated cycle.
            active_stiffness_kpa: (n, M) simulated active stiffness.
            measurement: The measurement operator.
            summary: The summary operator S(.).
        """
        simulated = (cycle_phase, active_stiffness_kpa)
        curves = total_curves(simulated, self.passive, self.observation, measurement)
        return summarise(curves, summary)


def read_measured_subjects(
    observations: Sequence[Path], passives: Sequence[Path]
) -> tuple[MeasuredSubject, ...]:
    """Read the subjects in the order of ``observations``; each file names its subject.

    Raises:
        ArtefactError: Observations and passive baselines are not of the same subjects, each once.
    """
    baselines = {load(path, PASSIVE)[1].subject: read_passive(path) for path in passives}
    recordings = [read_observation(path) for path in observations]
    names = [recording.subject for recording in recordings]
    if sorted(names) != sorted(baselines) or len(passives) != len(baselines):
        raise ArtefactError(
            f"observations of {names} and passive baselines of {sorted(baselines)}: "
            "each subject needs one of each"
        )
    return tuple(MeasuredSubject(recording, baselines[recording.subject]) for recording in recordings)


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
