"""Sections of the configuration: experiments, studies of them, subjects outside them, resources."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from swesbi.base.settings import Settings
from swesbi.checks.settings import (
    CalibrationSettings,
    CmaesSettings,
    EpochStudySettings,
    IdentifiabilitySettings,
    PredictiveSettings,
    PushesSettings,
    RecoverySettings,
)
from swesbi.measurement.settings import SpeedObservationSettings, SummarySettings
from swesbi.networks.settings import EstimatorSettings, FlowSettings, ObservationModelSettings
from swesbi.parameters import ParameterPrior
from swesbi.persons.settings import PlanSettings
from swesbi.population.settings import (
    ConditionSettings,
    NullSettings,
    PopulationSettings,
    PopulationSizes,
    StrataSettings,
)
from swesbi.posterior.settings import ExactSettings, PosteriorSettings
from swesbi.recording.settings import NoisePriorSettings
from swesbi.verdict.settings import MisspecificationSettings, SupportSettings, UninformativeSettings

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$", max_length=64)]

Subjects = Literal["all"] | tuple[Name, ...] | dict[str, tuple[Name, ...]]
"""Of an experiment: all of the study, a list, or by cohort's folder a list; of a cohort not named, all."""


class ExperimentSettings(Settings):
    """One experiment with noise on features, as in the paper: from its prior to how it is judged.

    Lists of subjects may be given by cohort: any other cohort then has all. The pool, and with it the
    network, is made of these subjects.
    """

    kind: Literal["features"] = Field(description="Where noise enters: on features of the curve.")
    subjects: Subjects = Field(
        description="'all', a list, or a list for each cohort that has one. The paper has six subjects (D "
        "of Sec. 2.4)."
    )
    prior: Name = Field(description="Name of one of the priors.")
    simulations_per_subject: int = Field(
        ge=10, description="N_theta, successful simulations from the prior (paper, Sec. 2.4)."
    )
    summary: SummarySettings = Field(description="The summary S(.) of a curve.")
    observation_model: ObservationModelSettings = Field(description="Noise on features of the curve.")
    estimator: EstimatorSettings = Field(description="The network.")
    support: SupportSettings = Field(description="When the prior supports a recording.")
    posterior: PosteriorSettings = Field(description="What is kept of the posterior.")
    predictive: PredictiveSettings = Field(description="Predictive checks.")
    recovery: RecoverySettings = Field(description="Recovery of known parameters.")
    epoch_study: EpochStudySettings = Field(description="The network as it was after earlier epochs.")


class SpeedExperimentSettings(Settings):
    """One experiment with noise on the measured speeds, and an exact likelihood."""

    kind: Literal["speeds"] = Field(description="Where noise enters: on the measured speeds.")
    subjects: Subjects = Field(
        description="'all', a list, or a list for each cohort that has one. They are also those of an "
        "experiment over a population that has this one as its base."
    )
    prior: Name = Field(description="Name of one of the priors.")
    simulations_per_subject: int = Field(
        ge=10,
        description="Successful simulations from the prior. Chosen by the learning curve.",
    )
    passive_stiffness_kpa: ParameterPrior = Field(
        description="Prior of the passive stiffness a at the largest stretch of the beat, a nuisance "
        "parameter. Diastolic septa of healthy adults have 2.6, 4.7 and 6.1 kPa at 20 to 39, 40 to 59 and "
        "60 to 79 years (Villemain et al., JACC Cardiovasc Imaging 2019;12:1135), if these are Young's "
        "moduli. Late-diastolic septal speeds of 1.3 to 1.45 m/s in the long axis (Song et al. 2016) are "
        "5.0 to 6.3 kPa."
    )
    summary: SummarySettings = Field(description="The summary S(.) of a curve.")
    observation_model: SpeedObservationSettings = Field(description="Noise on the measured speeds.")
    estimator: FlowSettings = Field(
        description="The network. Its architecture was chosen by held-out log-probability and importance "
        "efficiency."
    )
    exact: ExactSettings = Field(
        description="Exact posteriors: rounds of draws, the network's first, weighted with the simulator. "
        "MCMC follows where the weights fail."
    )
    predictive: PredictiveSettings = Field(description="Predictive checks.")
    misspecification: MisspecificationSettings = Field(
        description="Can the model have made the recording? The rule was fixed on well-specified "
        "recordings alone."
    )
    calibration: CalibrationSettings = Field(
        description="Recordings of known parameters. Nothing here changes a posterior that is reported."
    )
    identifiability: IdentifiabilitySettings = Field(description="What the recordings can tell.")


AnyExperiment = Annotated[ExperimentSettings | SpeedExperimentSettings, Field(discriminator="kind")]


class FreshCalibrationSettings(Settings):
    """Calibration on fresh contexts of a population, one recording each."""

    model_noise: int = Field(
        ge=1,
        description="Recordings under the model's own noise. Chosen: coverage of 90 % to 2.7 points (two "
        "standard errors). `make full` has 2,000.",
    )
    sample_by_sample: int = Field(
        ge=1,
        description="Recordings acquired sample by sample and ingested. Chosen: coverage of 90 % to 5.5 "
        "points. `make full` has 300.",
    )
    free_running: PushesSettings = Field(description="Free-running recordings, by `make full` alone.")
    strata: StrataSettings = Field(description="Cuts between strata.")
    two_sample_draws: int = Field(
        ge=50,
        description="Draws by which a classifier compares a subject's posterior with that of the base "
        "experiment. Chosen: accuracies to 1.1 points (one standard error).",
    )


class PopulationExperimentSettings(Settings):
    """One network for every context of a population; all else as in an experiment on speeds."""

    base: Name = Field(
        description="Experiment of kind speeds whose prior, observation model, exact posterior, "
        "predictive checks, calibration and verdict this one shares."
    )
    population: PopulationSettings = Field(description="Who the network is trained for.")
    conditions: ConditionSettings = Field(description="Recordings that the network learns from.")
    simulations: PopulationSizes = Field(description="Simulations that the network learns from.")
    estimator: FlowSettings = Field(
        description="The network. Chosen: three minutes on one core; the held-out loss is in "
        "amortised/training.csv."
    )
    calibration: FreshCalibrationSettings = Field(
        description="Calibration on fresh contexts, one recording each."
    )
    nulls: NullSettings = Field(description="Null distributions of the misspecification tests.")


class CmaesStudySettings(Settings):
    """The optimisation-based reference: within the bounds of one of the priors."""

    prior: Name = Field(description="Name of the prior whose bounds limit the search. Paper, Sec. 2.5.")
    search: CmaesSettings = Field(description="The searches.")


class PlanChoiceSettings(PlanSettings):
    """Planned studies, answered by the network of one experiment."""

    experiment: Name = Field(
        description="An experiment over a population, whose network answers the simulated persons. They "
        "have hearts that no cohort has."
    )


class NewSubjectsSettings(Settings):
    """Recordings outside the study, and how they are answered."""

    phases: int | None = Field(
        ge=8, le=60, description="Gated phases of their recordings; null: as many as recording.phases."
    )
    margin_fraction: float = Field(
        ge=0.0,
        lt=1.0,
        description="How far heart rate, LVEDV and IVSd may lie beyond those trained on, as a fraction of "
        "these limits. Chosen: a tenth.",
    )
    noise_level: float = Field(
        gt=0.0,
        lt=0.5,
        description="False-alarm rate of the test that a recording has the noise of its folder, for many "
        "repeats. Chosen: of three sweeps it is two to three times as high.",
    )
    noise_prior: NoisePriorSettings = Field(
        description="What is expected of the noise of their folder, before its repeats are seen."
    )
    uninformative: UninformativeSettings = Field(description="When a recording counts as uninformative.")


class ResourceSettings(Settings):
    """How the work is split and where it runs; nothing here may change a result."""

    shards_per_subject: int = Field(
        ge=1,
        le=1000,
        description="Simulation jobs a subject and prior. One takes a second, most of it start-up.",
    )
    population_parts: int = Field(
        ge=1,
        le=1000,
        description="Jobs of the simulations, and of the calibration, of an experiment over a population.",
    )
    device: Literal["auto", "cpu", "cuda"] = Field(
        description="Where the network is trained. auto takes a GPU where there is one, but not for "
        "procedure fast."
    )
