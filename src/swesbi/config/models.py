"""The models behind ``config.yaml``: what the study is made of, each part with its own settings."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, StringConstraints, model_validator

from swesbi.evaluation.settings import CmaesSettings, PredictiveSettings
from swesbi.forward_model import ForwardModelSettings
from swesbi.inference.settings import (
    AcquisitionSeedsSettings,
    EpochStudySettings,
    EstimatorSettings,
    ObservationModelSettings,
    PosteriorSettings,
    RecoverySettings,
    SupportSettings,
)
from swesbi.observation.settings import MeasurementSettings, PassiveSettings, SummarySettings
from swesbi.recording.settings import RecordingSettings
from swesbi.settings import Settings
from swesbi.simulations.prior import PriorSettings
from swesbi.virtual_cohort.settings import AcquisitionSettings

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$", max_length=64)]
RESERVED_NAMES = frozenset({"cohort", "simulations", "cmaes", "figures", "tables", "logs", "benchmarks"})


class ExperimentSettings(Settings):
    """One experiment: a prior, a summary, an observation model, an estimator, and how it is judged."""

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


class CmaesStudySettings(Settings):
    """The optimisation-based reference: within the bounds of one of the priors."""

    prior: Name = Field(description="name of the prior whose bounds limit the search")
    search: CmaesSettings


class ResourceSettings(Settings):
    """How the work is split and where it runs; nothing here may change a result."""

    shards_per_subject: int = Field(ge=1, le=1000, description="simulation jobs a subject and prior")
    device: Literal["auto", "cpu", "cuda"] = Field(description="where the network is trained")


class Config(Settings):
    """Every scientific choice of the study, and its resources."""

    seed: int = Field(ge=0, description="root of every random stream")
    cohort: str = Field(min_length=1, description="folder of the recordings")
    cohort_title: str = Field(min_length=1, description="what figures and tables call the subjects")
    subjects: Literal["all"] | tuple[Name, ...] = Field(description="'all', or a list of subjects")
    results: str = Field(min_length=1, description="folder of every output")
    recording: RecordingSettings
    measurement: MeasurementSettings
    forward_model: ForwardModelSettings
    passive: PassiveSettings
    passive_reference_prior: Name = Field(description="prior on whose log-centre the reference beat runs")
    acquisition: AcquisitionSettings
    priors: dict[Name, PriorSettings] = Field(min_length=1)
    experiments: dict[Name, ExperimentSettings] = Field(min_length=1)
    run: Literal["all"] | tuple[Name, ...] = Field(description="'all', or a list of experiments")
    main_experiment: Name = Field(description="the experiment whose cohort figures are drawn")
    cmaes: CmaesStudySettings
    acquisition_seeds: AcquisitionSeedsSettings
    resources: ResourceSettings

    @model_validator(mode="after")
    def _check_names(self) -> Self:
        users = {f"experiments.{name}.prior": part.prior for name, part in self.experiments.items()}
        users |= {"passive_reference_prior": self.passive_reference_prior, "cmaes.prior": self.cmaes.prior}
        for key, prior in users.items():
            if prior not in self.priors:
                raise ValueError(f"{key} names the prior {prior!r}; known priors: {', '.join(self.priors)}")
        if unknown := [name for name in self.experiments_run if name not in self.experiments]:
            raise ValueError(f"run: {unknown[0]!r} is not one of {', '.join(self.experiments)}")
        if self.main_experiment not in self.experiments_run:
            raise ValueError(f"main_experiment = {self.main_experiment!r}: not one of the experiments run")
        if reserved := RESERVED_NAMES & set(self.experiments):
            raise ValueError(
                f"experiments: {sorted(reserved)[0]!r} is the name of a results folder; choose another"
            )
        return self

    @model_validator(mode="after")
    def _check_protocol(self) -> Self:
        for name in ("phases", "density_kg_m3"):
            made, read = getattr(self.acquisition, name), getattr(self.recording, name)
            if made != read:
                raise ValueError(f"acquisition.{name} = {made} must equal recording.{name} = {read}")
        return self

    @model_validator(mode="after")
    def _check_posterior_draws(self) -> Self:
        for name, experiment in self.experiments.items():
            available, wanted = experiment.posterior.draws, experiment.predictive.draws
            if wanted > available:
                raise ValueError(
                    f"experiments.{name}.predictive.draws is {wanted}, but only {available} posterior "
                    f"draws are kept (experiments.{name}.posterior.draws)"
                )
        return self

    @property
    def experiments_run(self) -> tuple[str, ...]:
        """The experiments that the study runs, each once, in the order given."""
        return tuple(self.experiments) if self.run == "all" else tuple(dict.fromkeys(self.run))

    def simulations_per_subject(self, prior: str) -> int:
        """Return how many simulations the experiments that use this prior need, the most of any."""
        return max(part.simulations_per_subject for part in self.experiments.values() if part.prior == prior)
