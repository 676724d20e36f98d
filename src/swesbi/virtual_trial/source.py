"""What the virtual trial is drawn with: whom, from which prior, by which mechanics, and how it is read.

Its mechanics are those of the virtual volunteers, richer than the inference model's: valve inertance, wall
inertia, fine steps. What is not known of a heart is drawn from the prior of the study.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from swesbi.config.experiments import SpeedExperimentSettings
from swesbi.config.models import Config
from swesbi.heart.settings import ForwardModelSettings
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.parameters import THETA_NAMES
from swesbi.population.settings import PopulationSettings, of_group
from swesbi.prior import JointPriorSettings, ParameterPrior
from swesbi.recording.settings import RecordingSettings
from swesbi.virtual_cohort.settings import AcquisitionSettings
from swesbi.virtual_cohort.volunteers import COMMON
from swesbi.virtual_trial.settings import LOADING, POPULATION, PROTOCOL, SPEED_SCALE, TrialSettings

MECHANICS: Final = ForwardModelSettings.from_plain(dict(COMMON))


@dataclass(frozen=True)
class TrialSource:
    """What of the study's configuration the trial is drawn with.

    Attributes:
        trial: The design.
        population: Whose contexts they are: one group.
        model: Prior of phi between persons, and how phi becomes stiffness.
        bounds: Prior of phi of the study, whose bounds no visit leaves.
        protocol: How they are recorded.
        recording: Quality control.
        grid_points: Size of the analysis grid that ingestion fills.
        lvesv_fraction: Standard deviation of the logarithm of a measured LVESV.
        seed: The study's seed.
    """

    trial: TrialSettings
    population: PopulationSettings
    model: SpeedModelSettings
    bounds: JointPriorSettings
    protocol: AcquisitionSettings
    recording: RecordingSettings
    grid_points: int
    lvesv_fraction: float
    seed: int


def source_of(config: Config, trial: TrialSettings) -> TrialSource:
    """Return what the trial is drawn with: population of `amortised`, model of its base.

    Raises:
        ValueError: The prior fixes what the trial varies, or the population has no such group.
    """
    over_population = config.population_experiments[POPULATION]
    experiment = config.speed_experiments[over_population.base]
    prior = JointPriorSettings(
        theta=config.priors[experiment.prior], passive_scale_kpa=experiment.passive_scale_kpa
    )
    if fixed := [name for name in (*LOADING, SPEED_SCALE) if name not in prior.names]:
        raise ValueError(f"priors.{experiment.prior}.nuisances has no {fixed[0]}, which the trial varies")
    return TrialSource(
        trial=trial,
        population=of_group(over_population.population, trial.population_group),
        model=_model(config, experiment, narrowed(prior, trial.prior_share)),
        bounds=prior,
        protocol=PROTOCOL,
        recording=config.recording,
        grid_points=config.measurement.grid_points,
        lvesv_fraction=experiment.misspecification.rule.volumes.lvesv_tolerance_fraction,
        seed=config.seed,
    )


def _model(
    config: Config, experiment: SpeedExperimentSettings, prior: JointPriorSettings
) -> SpeedModelSettings:
    return SpeedModelSettings(
        prior=prior,
        discrepancy=experiment.observation_model.discrepancy,
        forward_model=MECHANICS,
        measurement=config.measurement,
        passive=config.passive,
        passive_beat="own",
        passive_reference_prior=config.priors[config.passive_reference_prior],
        density_kg_m3=config.recording.density_kg_m3,
    )


def narrowed(prior: JointPriorSettings, share: float) -> JointPriorSettings:
    """Return the prior with a share of its spread of theta and of the passive scale; the rest as it is."""

    def narrow(parameter: ParameterPrior) -> ParameterPrior:
        return parameter.model_copy(update={"log_sd": share * parameter.log_sd})

    theta = {name: narrow(getattr(prior.theta, name)) for name in THETA_NAMES}
    return JointPriorSettings(
        theta=prior.theta.model_copy(update=theta), passive_scale_kpa=narrow(prior.passive_scale_kpa)
    )
