"""What the virtual trial is drawn with: whom, from which prior, by which mechanics, and how it is read.

Its mechanics are those of the virtual volunteers, richer than the inference model's: valve inertance, wall
inertia, fine steps. What is not known of a heart is drawn from the prior of the study.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from swesbi.heart.settings import ForwardModelSettings
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.parameters import THETA_NAMES
from swesbi.population.settings import PopulationSettings
from swesbi.prior import JointPriorSettings, ParameterPrior
from swesbi.recording.acquisition_settings import AcquisitionSettings
from swesbi.recording.settings import RecordingSettings
from swesbi.virtual.trial.settings import TrialSettings
from swesbi.virtual.volunteers import COMMON

MECHANICS: Final = ForwardModelSettings.from_plain(dict(COMMON))


@dataclass(frozen=True)
class TrialSource:
    """What of the study's configuration the trial is drawn with.

    Attributes:
        trial: The design.
        population: Whose contexts they are: one group.
        model: Prior of phi between persons, and how phi becomes stiffness.
        bounds: Prior of phi of the study, whose bounds no visit leaves.
        acquisition: How they are recorded.
        recording: Quality control.
        grid_points: Size of the analysis grid that ingestion fills.
        lvesv_fraction: Standard deviation of the logarithm of a measured LVESV.
        seed: The study's seed.
    """

    trial: TrialSettings
    population: PopulationSettings
    model: SpeedModelSettings
    bounds: JointPriorSettings
    acquisition: AcquisitionSettings
    recording: RecordingSettings
    grid_points: int
    lvesv_fraction: float
    seed: int


def narrowed(prior: JointPriorSettings, share: float) -> JointPriorSettings:
    """Return the prior with a share of its spread of theta and passive stiffness; the rest as it is."""

    def narrow(parameter: ParameterPrior) -> ParameterPrior:
        return parameter.model_copy(update={"log_sd": share * parameter.log_sd})

    theta = {name: narrow(getattr(prior.theta, name)) for name in THETA_NAMES}
    return JointPriorSettings(
        theta=prior.theta.model_copy(update=theta), passive_stiffness_kpa=narrow(prior.passive_stiffness_kpa)
    )


def noisier(acquisition: AcquisitionSettings, factor: float) -> AcquisitionSettings:
    """Return the acquisition with so many times the errors of samples, repeats and sweeps."""
    names = ("sample_sd_fraction", "repeat_sd_fraction", "sweep_fraction")
    return acquisition.model_copy(update={name: factor * getattr(acquisition, name) for name in names})
