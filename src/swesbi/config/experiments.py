"""The models behind the experiments of ``config.yaml``, each part with its own settings."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from swesbi.base.settings import Settings
from swesbi.checks.calibration.settings import CalibrationSettings, PushesSettings
from swesbi.checks.identifiability.settings import IdentifiabilitySettings
from swesbi.checks.settings import EpochStudySettings, PredictiveSettings, RecoverySettings
from swesbi.measurement.settings import PassiveBeat, SpeedObservationSettings, SummarySettings
from swesbi.networks.settings import EstimatorSettings, ObservationModelSettings, SplineSettings
from swesbi.population.settings import (
    ConditionSettings,
    NullSettings,
    PopulationSettings,
    PopulationSizes,
    StrataSettings,
)
from swesbi.posterior.settings import ExactSettings, PosteriorSettings
from swesbi.prior import ParameterPrior
from swesbi.verdict.settings import MisspecificationSettings, SupportSettings

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$", max_length=64)]

Subjects = Literal["all"] | tuple[Name, ...] | dict[str, tuple[Name, ...]]
"""Of an experiment: all of the study, a list, or by cohort's folder a list; of a cohort not named, all."""


class ExperimentSettings(Settings):
    """One experiment with noise on features, as in the paper: from its prior to how it is judged."""

    kind: Literal["features"] = Field(description="where noise enters: on features of the curve")
    subjects: Subjects = Field(description="'all', a list, or a list for each cohort that has one")
    prior: Name = Field(description="name of one of the priors")
    simulations_per_subject: int = Field(ge=10, description="successful simulations from the prior")
    summary: SummarySettings
    observation_model: ObservationModelSettings
    estimator: EstimatorSettings
    support: SupportSettings
    posterior: PosteriorSettings
    predictive: PredictiveSettings
    recovery: RecoverySettings
    epoch_study: EpochStudySettings


class SpeedExperimentSettings(Settings):
    """One experiment with noise on the measured speeds, and an exact likelihood."""

    kind: Literal["speeds"] = Field(description="where noise enters: on the measured speeds")
    subjects: Subjects = Field(description="'all', a list, or a list for each cohort that has one")
    prior: Name = Field(description="name of one of the priors")
    simulations_per_subject: int = Field(ge=10, description="successful simulations from the prior")
    passive_scale_kpa: ParameterPrior = Field(
        description="prior of the passive scale a, a nuisance parameter"
    )
    passive_beat: PassiveBeat = Field(
        description="along whose stretch the passive stiffness runs: each simulation's own beat, or the "
        "reference beat at the centre of passive_reference_prior"
    )
    summary: SummarySettings
    observation_model: SpeedObservationSettings
    estimator: SplineSettings
    exact: ExactSettings
    predictive: PredictiveSettings
    misspecification: MisspecificationSettings
    calibration: CalibrationSettings
    identifiability: IdentifiabilitySettings


AnyExperiment = Annotated[ExperimentSettings | SpeedExperimentSettings, Field(discriminator="kind")]


class FreshCalibrationSettings(Settings):
    """Calibration on fresh contexts of a population, one recording each."""

    own: int = Field(ge=1, description="recordings under the model's own noise")
    acquired: int = Field(ge=1, description="recordings acquired sample by sample and ingested")
    free_running: PushesSettings = Field(description="of `make full`, which is no part of the study")
    strata: StrataSettings
    two_sample_draws: int = Field(
        ge=50, description="draws by which a subject's posterior is told from that of the base experiment"
    )


class PopulationExperimentSettings(Settings):
    """One network for every context of a population; all else as in an experiment on speeds."""

    base: Name = Field(
        description="experiment of kind speeds whose prior, observation model, exact posterior, predictive "
        "checks, calibration and verdict this one shares"
    )
    population: PopulationSettings
    conditions: ConditionSettings
    simulations: PopulationSizes
    estimator: SplineSettings
    calibration: FreshCalibrationSettings
    nulls: NullSettings
