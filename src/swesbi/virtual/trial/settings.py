"""The design of the virtual trial: how many persons, what differs between visits, and what the drug does.

Every number was chosen before any recording of the trial had been answered. They stand here and not in the
study's configuration since no result of the study depends on them.

Its mechanics are those of the virtual volunteers, richer than the inference model's: valve inertance, wall
inertia, fine steps. What is not known of a heart is drawn from the prior of the study.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

from pydantic import Field

from swesbi.base.settings import Settings
from swesbi.heart.settings import ForwardModelSettings
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.parameters import THETA_NAMES
from swesbi.population.settings import PopulationSettings
from swesbi.prior import JointPriorSettings, ParameterPrior
from swesbi.recording.acquisition_settings import ACQUISITION, AcquisitionSettings
from swesbi.recording.settings import RecordingSettings
from swesbi.virtual.volunteers import COMMON

Spread = Annotated[float, Field(ge=0, lt=0.5)]
STREAM: Final = "virtual trial"
"""Name of the trial's streams under the study's seed."""
CONTROL, TREATED = "control", "treated"
BEFORE, AFTER = "before", "after"
POPULATION: Final = "amortised"
"""The experiment over a population whose persons take part."""
GROUPS: Final = (CONTROL, TREATED)
VISITS: Final = (BEFORE, AFTER)
LOADING: Final = ("distal_resistance_pa_s_m3", "arterial_time_constant_s")
"""What of a person's physiology is of the day, beside the heart rate."""
SPEED_SCALE: Final = "speed_scale"
AT_SCALE_ONE: Final = ACQUISITION.model_copy(update={"scale_fraction": 0.0})
"""That of the virtual volunteers; the scale of the speeds is a person's in part, and so drawn with them."""
MECHANICS: Final = ForwardModelSettings.from_plain(dict(COMMON))


class TrialSettings(Settings):
    """Who takes part, and what changes; spreads are standard deviations of logarithms."""

    persons_per_group: int = Field(ge=1, description="persons of each group")
    population_group: str = Field(description="group of the study's population whose persons they are")
    prior_share: float = Field(
        gt=0,
        le=1,
        description="spread of theta and of the passive stiffness between persons, over that of the prior",
    )
    theta_spread: Spread = Field(description="of each of theta from visit to visit of a person")
    passive_spread: Spread = Field(description="of the passive stiffness from visit to visit")
    loading_spread: Spread = Field(description="of R_d, and of the time constant, from visit to visit")
    heart_rate_spread: Spread = Field(description="of the heart rate from visit to visit")
    kept_scale_share: float = Field(
        ge=0, le=1, description="share of the variance of the log scale of speeds that a person keeps"
    )
    weeks_between: float = Field(gt=0, description="between the visits")
    effect: dict[str, float] = Field(description="factor on parameters of the treated at the second visit")
    ejection_fraction: tuple[float, float] = Field(
        description="of the beat at the first visit, of a person who takes part"
    )


TRIAL: Final = TrialSettings(
    persons_per_group=12,
    population_group="adults",
    prior_share=0.5,
    theta_spread=0.05,
    passive_spread=0.05,
    loading_spread=0.08,
    heart_rate_spread=0.06,
    kept_scale_share=0.5,
    weeks_between=12.0,
    effect={"k0_kpa": 1.1, "k_sr_per_s": 0.75},
    ejection_fraction=(0.5, 0.75),
)
"""The shipped design; all of it is chosen, but for the ejection fraction of health (Lang et al., J Am Soc
Echocardiogr 28:1, 2015)."""


@dataclass(frozen=True)
class TrialSource:
    """What of the study's configuration the trial is drawn with.

    Contexts are of one group of the population. ``model`` has the prior of phi between persons, ``bounds``
    that of the study, whose bounds no visit leaves; ``lvesv_fraction`` is the sd of the logarithm of a
    measured LVESV.
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
