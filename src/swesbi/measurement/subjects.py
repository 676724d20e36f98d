"""The subjects of a cohort as inference reads them from its artefacts: by features, or by speeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import ArtefactError, load
from swesbi.context import Context
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import Beats, simulate
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, speed_model
from swesbi.measurement.operator import KIND as PASSIVE
from swesbi.measurement.operator import PassiveBaseline, read_passive, total_at_phases, total_curves
from swesbi.measurement.settings import MeasurementSettings, SummarySettings
from swesbi.measurement.speeds import measured_speeds
from swesbi.measurement.summary import summarise
from swesbi.prior import PriorSettings, log_centre
from swesbi.recording.noise import read_noise
from swesbi.recording.observation import Observation, read_observation
from swesbi.recording.speed import NoiseComponents

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class MeasuredSubject:
    """One subject's recording, passive baseline and measurement operator.

    Its methods take simulated cycles: their M phases (M,), and n active stiffnesses in kPa (n, M).
    """

    observation: Observation
    passive: PassiveBaseline
    measurement: MeasurementSettings

    def on_grid(self, cycle_phase: FloatArray, active_stiffness_kpa: FloatArray) -> FloatArray:
        """Return total curves (n, grid) in kPa, measured at the subject's measured phases (paper, Eq. 3)."""
        active = (cycle_phase, active_stiffness_kpa)
        return total_curves(active, self.passive, self.observation, self.measurement)

    def at_phases(self, cycle_phase: FloatArray, active_stiffness_kpa: FloatArray) -> FloatArray:
        """Return total stiffness (n, phases) in kPa at every phase of the recording."""
        active = (cycle_phase, active_stiffness_kpa)
        return total_at_phases(active, self.passive, self.observation, self.measurement)

    def observed_features(self, summary: SummarySettings) -> FloatArray:
        """Return x_obs = S(E_obs) of shape (F,) (paper, Eq. 4)."""
        features: FloatArray = summarise(self.observation.curve_kpa[None], summary)[0]
        return features

    def simulated_features(
        self, cycle_phase: FloatArray, active_stiffness_kpa: FloatArray, summary: SummarySettings
    ) -> FloatArray:
        """Return x = S(E_sim) of shape (n, F) (paper, Eq. 4)."""
        return summarise(self.on_grid(cycle_phase, active_stiffness_kpa), summary)


def read_measured_subjects(
    observations: Sequence[Path], passives: Sequence[Path], measurement: MeasurementSettings
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
    return tuple(
        MeasuredSubject(recording, baselines[recording.subject], measurement) for recording in recordings
    )


def reference_beat(context: Context, prior: PriorSettings, forward_model: ForwardModelSettings) -> Beats:
    """Return the beat at the prior's log-centre along which a passive baseline is calibrated."""
    return simulate(log_centre(prior)[None, :], context, forward_model)


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
