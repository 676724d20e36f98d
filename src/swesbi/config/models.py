"""The models behind ``config.yaml``: what the study is made of, each part with its own settings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal, Self

from pydantic import Field, StringConstraints, model_validator

from swesbi.calibration.settings import CalibrationSettings
from swesbi.config.checks import CHECKS
from swesbi.discrepancy.settings import DiscrepancyStudySettings
from swesbi.evaluation.settings import CmaesSettings, PredictiveSettings
from swesbi.exact.settings import ExactSettings, RefinementSettings
from swesbi.flow.settings import FlowSettings
from swesbi.forward_model.settings import ForwardModelSettings
from swesbi.identifiability.settings import IdentifiabilitySettings
from swesbi.inference.settings import (
    AcquisitionSeedsSettings,
    EpochStudySettings,
    EstimatorSettings,
    ObservationModelSettings,
    PosteriorSettings,
    RecoverySettings,
    SupportSettings,
)
from swesbi.misspecification.settings import MisspecificationSettings
from swesbi.noise.settings import NoiseSettings
from swesbi.observation.settings import MeasurementSettings, PassiveSettings, SummarySettings
from swesbi.population.settings import (
    ConditionSettings,
    NullSettings,
    PopulationSettings,
    PopulationSizes,
    StrataSettings,
)
from swesbi.prior import ParameterPrior, PriorSettings
from swesbi.recording.settings import RecordingSettings
from swesbi.sensitivity.settings import Variant
from swesbi.settings import Settings
from swesbi.speed_model.settings import SpeedObservationSettings
from swesbi.virtual_cohort.settings import AcquisitionSettings

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$", max_length=64)]


class ExperimentSettings(Settings):
    """One experiment with noise on features, as in the paper: from its prior to how it is judged."""

    kind: Literal["features"] = Field(description="where noise enters: on features of the curve")
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
    prior: Name = Field(description="name of one of the priors")
    simulations_per_subject: int = Field(ge=10, description="successful simulations from the prior")
    passive_scale_kpa: ParameterPrior = Field(
        description="prior of the passive scale a, a nuisance parameter"
    )
    summary: SummarySettings
    observation_model: SpeedObservationSettings
    estimator: FlowSettings
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
    estimator: FlowSettings
    calibration: FreshCalibrationSettings
    nulls: NullSettings


class CmaesStudySettings(Settings):
    """The optimisation-based reference: within the bounds of one of the priors."""

    prior: Name = Field(description="name of the prior whose bounds limit the search")
    search: CmaesSettings


class DiscrepancyChoiceSettings(DiscrepancyStudySettings):
    """The choice of the discrepancy for one experiment."""

    experiment: Name = Field(description="an experiment of kind speeds")


class SensitivitySettings(Settings):
    """Variants of one experiment, each rerun with a choice made otherwise."""

    experiment: Name = Field(description="an experiment of kind speeds")
    short_training_epochs: int = Field(ge=1, description="epochs of the variants without `full_training`")
    variants: dict[Name, Variant] = Field(min_length=2, description="`base`, without changes, among them")


class NewSubjectsSettings(Settings):
    """Recordings that the trained network answers without being trained on them."""

    cohort: str | None = Field(description="folder of their recordings; null: there are none")
    phases: int | None = Field(
        ge=8, le=60, description="gated phases of their recordings; null: as configured"
    )
    cohort_title: str = Field(min_length=1, description="what their figures call them")
    margin_fraction: float = Field(
        ge=0.0, lt=1.0, description="how far beyond the contexts trained on, as a fraction of their limits"
    )
    noise_level: float = Field(
        gt=0.0, lt=0.5, description="of the test that a recording has the pool's noise"
    )
    refinement: RefinementSettings


class ResourceSettings(Settings):
    """How the work is split and where it runs; nothing here may change a result."""

    shards_per_subject: int = Field(ge=1, le=1000, description="simulation jobs a subject and prior")
    population_parts: int = Field(
        ge=1, le=1000, description="jobs of the simulations, and of the calibration, over a population"
    )
    subjects_per_job: int | None = Field(
        ge=1, description="subjects of a job that serves a large cohort; null: as many as keep jobs few"
    )
    device: Literal["auto", "cpu", "cuda"] = Field(description="where the network is trained")


class Config(Settings):
    """Every scientific choice of the study, and its resources."""

    seed: int = Field(ge=0, description="root of every random stream")
    cohort: str = Field(min_length=1, description="folder of the recordings")
    cohort_title: str = Field(min_length=1, description="what figures and tables call the subjects")
    subjects: Literal["all"] | tuple[Name, ...] = Field(description="'all', or a list of subjects")
    results: str = Field(min_length=1, description="folder of every output")
    recording: RecordingSettings
    noise: NoiseSettings
    measurement: MeasurementSettings
    forward_model: ForwardModelSettings
    passive: PassiveSettings
    passive_reference_prior: Name = Field(description="prior on whose log-centre the reference beat runs")
    acquisition: AcquisitionSettings
    priors: dict[Name, PriorSettings] = Field(min_length=1)
    experiments: dict[Name, AnyExperiment] = Field(min_length=1)
    population_experiments: dict[Name, PopulationExperimentSettings] = Field(
        description="experiments whose network is trained over a population instead of the cohort"
    )
    run: Literal["all"] | tuple[Name, ...] = Field(description="'all', or a list of experiments")
    main_experiment: Name = Field(description="the experiment whose cohort figures are drawn")
    cmaes: CmaesStudySettings
    acquisition_seeds: AcquisitionSeedsSettings
    discrepancy_study: DiscrepancyChoiceSettings
    sensitivity: SensitivitySettings
    new_subjects: NewSubjectsSettings
    resources: ResourceSettings

    @model_validator(mode="after")
    def _check_across_parts(self) -> Self:
        for check in CHECKS:
            check(self)
        return self

    @property
    def experiments_run(self) -> tuple[str, ...]:
        """The experiments on the cohort that the study runs, each once, in the order given."""
        return tuple(name for name in self._run if name in self.experiments)

    @property
    def populations_run(self) -> tuple[str, ...]:
        """The experiments over a population that the study runs, each once, in the order given."""
        return tuple(name for name in self._run if name in self.population_experiments)

    @property
    def _run(self) -> tuple[str, ...]:
        everything = (*self.experiments, *self.population_experiments)
        return everything if self.run == "all" else tuple(dict.fromkeys(self.run))

    def base_of(self, experiment: str) -> str:
        """Return the experiment on the cohort that one over a population shares its model with, or itself."""
        over_population = self.population_experiments.get(experiment)
        return over_population.base if over_population else experiment

    @property
    def feature_experiments(self) -> Mapping[str, ExperimentSettings]:
        """The experiments with noise on features, by name."""
        parts = self.experiments.items()
        return {name: part for name, part in parts if isinstance(part, ExperimentSettings)}

    @property
    def speed_experiments(self) -> Mapping[str, SpeedExperimentSettings]:
        """The experiments with noise on the measured speeds, by name."""
        parts = self.experiments.items()
        return {name: part for name, part in parts if isinstance(part, SpeedExperimentSettings)}

    def simulations_per_subject(self, prior: str) -> int:
        """Return how many simulations the experiments that use this prior need, the most of any."""
        return max(part.simulations_per_subject for part in self.experiments.values() if part.prior == prior)
