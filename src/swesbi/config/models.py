"""The whole configuration, and what no part of it can see alone: what must fit together.

Each check raises a ValueError that names the key, its value and what it must fit.
"""

from __future__ import annotations

import json
import operator
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final, Literal, Self

from pydantic import Field, model_validator

from swesbi.base.settings import Settings
from swesbi.config.experiments import (
    AnyExperiment,
    CmaesStudySettings,
    ExperimentSettings,
    Name,
    NewSubjectsSettings,
    PlanChoiceSettings,
    PopulationExperimentSettings,
    ResourceSettings,
    SpeedExperimentSettings,
)
from swesbi.heart.settings import ForwardModelSettings
from swesbi.measurement.settings import (
    MeasurementSettings,
    PassiveSettings,
    summary_names,
)
from swesbi.parameters import THETA_NAMES, THETA_RANGES, NuisanceSettings
from swesbi.persons.settings import ChangeGroupsSettings, ChangeSettings, HierarchySettings
from swesbi.posterior.settings import asking, first_counts
from swesbi.prior import PriorSettings
from swesbi.recording.cohort.clinical import ClinicalErrors
from swesbi.recording.settings import AcquisitionSettings, NoiseSettings, RecordingSettings

EQUAL: Final = (
    ("passive.late_diastolic_window", "recording.late_diastolic_window"),
    ("acquisition.phases", "recording.phases"),
    ("acquisition.density_kg_m3", "recording.density_kg_m3"),
)
"""Keys that say the same of measured recordings and of what is compared with them."""
FOLDERS: Final = frozenset({"cohort", "simulations", "cmaes", "figures", "tables", "logs", "studies"})


def check_prior_names(config: Config) -> None:
    """Every prior that is named exists, with free nuisance parameters where they are integrated out alone."""
    users = {f"experiments.{name}.prior": part.prior for name, part in config.experiments.items()}
    users |= {"passive_reference_prior": config.passive_reference_prior, "cmaes.prior": config.cmaes.prior}
    integrated = {f"experiments.{name}.prior" for name in config.speed_experiments}
    for key, prior in users.items():
        if prior not in config.priors:
            raise ValueError(f"{key} names the prior {prior!r}; known priors: {', '.join(config.priors)}")
        if key not in integrated and config.priors[prior].nuisances != NuisanceSettings():
            raise ValueError(
                f"{key} names the prior {prior!r}, which frees nuisance parameters; only experiments of kind "
                "speeds integrate them out: name a prior without them"
            )


def check_experiment_names(config: Config) -> None:
    """Every experiment that is to run exists, the main one among them; none is called like a folder."""
    known = (*config.experiments, *config.population_experiments)
    if unknown := [name for name in config.run if config.run != "all" and name not in known]:
        raise ValueError(f"run: {unknown[0]!r} is not one of {', '.join(known)}")
    if config.experiments_run and config.main_experiment not in config.experiments_run:
        raise ValueError(f"main_experiment = {config.main_experiment!r}: not one of the experiments run")
    if config.main_experiment not in config.feature_experiments:
        raise ValueError(
            f"main_experiment = {config.main_experiment!r}: the paper's figures need kind: features"
        )
    if doubled := set(config.experiments) & set(config.population_experiments):
        raise ValueError(f"population_experiments: {sorted(doubled)[0]!r} is the name of another experiment")
    if reserved := FOLDERS & set(known):
        raise ValueError(
            f"experiments: {sorted(reserved)[0]!r} is the name of a results folder; choose another"
        )


def check_subjects(config: Config) -> None:
    """A list of subjects names at least one, each once."""
    for key, names in config.subject_lists.items():
        if not names or len(set(names)) < len(names):
            raise ValueError(f"{key} = {list(names)}: name at least one subject, each once")


def check_prior_ranges(config: Config) -> None:
    """No prior leaves the range of theta in which the forward model is declared."""
    for name, prior in config.priors.items():
        for parameter, part, (low, high) in zip(THETA_NAMES, prior.parameters, THETA_RANGES, strict=True):
            if part.low < low or part.high > high:
                raise ValueError(
                    f"priors.{name}.{parameter}: bounds {part.low:g} to {part.high:g} leave the range "
                    f"{low:g} to {high:g} in which the forward model is declared; check the unit"
                )


def check_feature_names(config: Config) -> None:
    """Noise and predictive checks name features that the experiment's summary has."""
    for name, experiment in config.experiments.items():
        known = summary_names(experiment.summary)
        named: dict[str, Iterable[str]] = {"predictive.features": experiment.predictive.features}
        if name in config.feature_experiments:
            noise = config.feature_experiments[name].observation_model
            named["observation_model.feature_noise_sd"] = noise.feature_noise_sd
        for key, features in named.items():
            if unknown := [feature for feature in features if feature not in known]:
                raise ValueError(
                    f"experiments.{name}.{key} names the feature {unknown[0]!r}; known: {', '.join(known)}"
                )


def check_recordings(config: Config) -> None:
    """Synthetic recordings follow the protocol of measured ones, and the baseline is of their window."""
    for key, other in EQUAL:
        here, there = (json.dumps(operator.attrgetter(name)(config)) for name in (key, other))
        if here != there:
            raise ValueError(
                f"{key} = {here} must equal {other} = {there}; set {key} in the file that sets {other}"
            )
    if config.acquisition.missing_phases:
        raise ValueError(
            f"acquisition.missing_phases = {list(config.acquisition.missing_phases)} must be empty: each "
            "synthetic recording misses the phases that its subject's recording misses"
        )


def check_draws(config: Config) -> None:
    """No check takes more simulations or posterior draws of an experiment than there are."""
    for name, experiment in config.experiments.items():
        predictive = experiment.predictive.draws
        taken = [("predictive.draws", predictive, "simulations_per_subject")]
        if name in config.feature_experiments:
            taken += [("predictive.draws", predictive, "posterior.draws")]
        else:
            speeds = config.speed_experiments[name]
            local, made = speeds.calibration.local, speeds.calibration.recordings
            _, of_network = first_counts(asking(speeds.exact, made.effective_draws))
            if made.network_draws > of_network:
                raise ValueError(
                    f"experiments.{name}: calibration.recordings.network_draws is {made.network_draws}, but "
                    f"only {of_network} are there in the first round of so few effective_draws; raise these"
                )
            taken += [
                ("predictive.draws", predictive, "exact.draws"),
                ("twice calibration.local.replicates", 2 * local.replicates, "exact.draws"),
                ("calibration.local.two_sample_draws", local.two_sample_draws, "exact.draws"),
            ]
        for key, wanted, source in taken:
            available = operator.attrgetter(source)(experiment)
            if wanted > available:
                raise ValueError(
                    f"experiments.{name}: {key} is {wanted}, but only {available} are there "
                    f"(experiments.{name}.{source})"
                )


def check_population_experiments(config: Config) -> None:
    """An experiment over a population shares its model with one that has an exact likelihood."""
    for name, experiment in config.population_experiments.items():
        if experiment.base not in config.speed_experiments:
            known = ", ".join(config.speed_experiments) or "none"
            raise ValueError(
                f"population_experiments.{name}.base = {experiment.base!r} is no experiment of kind speeds; "
                f"known: {known}"
            )


def check_plan(config: Config) -> None:
    """A plan has a network over a population, and one of its groups."""
    plan = config.plan
    if plan.experiment not in config.population_experiments:
        listed = ", ".join(config.population_experiments) or "none"
        raise ValueError(
            f"plan.experiment = {plan.experiment!r} is no experiment over a population; known: {listed}"
        )
    population = config.population_experiments[plan.experiment].population
    if plan.persons.group not in population.groups:
        known = ", ".join(population.groups)
        raise ValueError(f"plan.persons.group = {plan.persons.group!r}: the population has {known}")


class Config(Settings):
    """Every scientific choice of the study, and its resources.

    What a study sets most often stands in config.yaml, every other choice in config/, a file a concern.
    A key of config.yaml wins over theirs. The first sentence of a field's description is its meaning.
    What follows is the reason of the shipped value. "Paper" is the study that is reproduced, "chosen"
    is ours.
    """

    seed: int = Field(ge=0, description="Root of every random stream. Chosen before any result was seen.")
    cohort: str = Field(
        min_length=1,
        description="Folder of the recordings, with subjects.csv, recording.yaml and swe/<subject>.csv.",
    )
    cohort_title: str = Field(min_length=1, description="What figures and tables call the subjects.")
    subjects: Literal["all"] | tuple[Name, ...] = Field(
        description="'all', or a list of subjects. A list restricts every experiment. The noise of the "
        "speeds is estimated from these subjects."
    )
    results: str = Field(min_length=1, description="Folder of every output.")
    networks: str | None = Field(
        description="Folder of a finished study whose networks over speeds are taken; null: they are "
        "trained. config/overlays/full.yaml names one."
    )
    recording: RecordingSettings = Field(description="Which samples and recordings are used.")
    noise: NoiseSettings = Field(description="How the noise of the speeds is estimated.")
    clinical: ClinicalErrors = Field(
        description="Errors of cuff pressures and ejection time, optional columns of subjects.csv."
    )
    measurement: MeasurementSettings = Field(description="How a simulated cycle becomes a curve.")
    forward_model: ForwardModelSettings = Field(
        description="The heart: equations, material, circulation and numerics."
    )
    passive: PassiveSettings = Field(description="The passive baseline.")
    passive_reference_prior: Name = Field(
        description="Prior on whose log-centre the reference beat runs, whatever the experiment."
    )
    acquisition: AcquisitionSettings = Field(
        description="How synthetic recordings are made, those behind recovery_acquisition.csv among them. "
        "It has noise as a laboratory may have it, as volunteers G and H do."
    )
    priors: dict[Name, PriorSettings] = Field(
        min_length=1,
        description="Priors by name. `paper` is that of the paper; `calibrated` frees what is not known "
        "of a heart; `wide` has wider timing bounds.",
    )
    experiments: dict[Name, AnyExperiment] = Field(
        min_length=1,
        description="Experiments on one cohort, by name. `paper` is the frozen configuration of the "
        "paper. `scalar_only` is its ablation (paper, Sec. 2.3): the 16 scalars without the trajectory. "
        "`wide_prior` differs from it by wider timing bounds alone. `calibrated` has noise on the "
        "measured speeds, estimated from repeats, and exact posteriors, which are checked.",
    )
    population_experiments: dict[Name, PopulationExperimentSettings] = Field(
        description="Experiments whose network is trained over a population instead of the cohort "
        "(docs/population.md). `amortised` has one network for any heart within the declared range."
    )
    run: Literal["all"] | tuple[Name, ...] = Field(description="'all', or a list of experiments.")
    main_experiment: Name = Field(description="The experiment whose figures 2 and 3 are drawn.")
    validation_table: str | None = Field(
        min_length=1,
        description="Stored table of the validation's rounds, of which the page of results shows the last "
        "whole one where the table is there; null: shows none.",
    )
    cmaes: CmaesStudySettings = Field(description="Fits by optimisation, which belong to no experiment.")
    cohort_posterior: HierarchySettings = Field(
        description="The cohort as a posterior, of each experiment with exact posteriors "
        "(docs/population.md)."
    )
    changes: ChangeSettings = Field(
        description="Two visits of one person, inferred together (docs/compare-and-plan.md)."
    )
    change_groups: ChangeGroupsSettings = Field(
        description="What has changed in groups of persons with two visits (docs/compare-and-plan.md)."
    )
    plan: PlanChoiceSettings = Field(
        description="`python -m swesbi plan`: persons and repeats that a study needs, from simulated "
        "studies (docs/compare-and-plan.md)."
    )
    new_subjects: NewSubjectsSettings = Field(
        description="Recordings outside the study that its networks answer (docs/own-data.md)."
    )
    resources: ResourceSettings = Field(description="How the work is split and where it runs.")

    @model_validator(mode="after")
    def _check_across_parts(self) -> Self:
        for check in (
            check_prior_names,
            check_experiment_names,
            check_subjects,
            check_prior_ranges,
            check_feature_names,
            check_recordings,
            check_draws,
            check_population_experiments,
            check_plan,
        ):
            check(self)
        if self.networks is not None and Path(self.networks).resolve() == Path(self.results).resolve():
            raise ValueError(
                f"networks = {self.networks!r} is the folder of these results, which has none to take from; "
                "write null, or put other `results` in an overlay as config/overlays/full.yaml does"
            )
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

    def listed_subjects(self, experiment: str) -> tuple[str, ...] | None:
        """Return the subjects that an experiment lists for the study's cohort; None where it takes all.

        One over a population has the subjects of the experiment that it shares its model with.
        """
        chosen = self.experiments[self.base_of(experiment)].subjects
        if isinstance(chosen, dict):
            here = Path(self.cohort).resolve()
            of_cohort = (names for folder, names in chosen.items() if Path(folder).resolve() == here)
            return next(of_cohort, None)
        return None if chosen == "all" else chosen

    @property
    def subject_lists(self) -> Mapping[str, tuple[str, ...]]:
        """The lists of subjects of the study's cohort, by key; a key that takes all has none."""
        lists = {"subjects": None if self.subjects == "all" else self.subjects}
        lists |= {f"experiments.{name}.subjects": self.listed_subjects(name) for name in self.experiments}
        return {key: names for key, names in lists.items() if names is not None}

    def base_of(self, experiment: str) -> str:
        """Return the experiment on the cohort that one over a population shares its model with, or itself."""
        over_population = self.population_experiments.get(experiment)
        return over_population.base if over_population else experiment

    @property
    def feature_experiments(self) -> Mapping[str, ExperimentSettings]:
        """The experiments with noise on features, by name."""
        return {name: part for name, part in self.experiments.items() if isinstance(part, ExperimentSettings)}

    @property
    def speed_experiments(self) -> Mapping[str, SpeedExperimentSettings]:
        """The experiments with noise on the measured speeds, by name."""
        return {
            name: part for name, part in self.experiments.items() if isinstance(part, SpeedExperimentSettings)
        }

    def simulations_per_subject(self, prior: str) -> int:
        """Return how many simulations the experiments that use this prior need, the most of any."""
        return max(part.simulations_per_subject for part in self.experiments.values() if part.prior == prior)
