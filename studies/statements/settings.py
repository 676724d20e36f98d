"""Settings of the statements' study: trainings, acquisitions, readings, and what each job depends on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, Literal, Self

from pydantic import Field, JsonValue, model_validator

from swesbi.base.settings import Settings
from swesbi.checks.settings import CurveLossSettings
from swesbi.config.read import ConfigError, overlay
from swesbi.config.study import Study
from swesbi.config.view import View
from swesbi.seeds import integer_seed
from swesbi.study.stage import plain_settings

TRAINING: Final = "training-"
OF_STUDY: Final = f"{TRAINING}1"
"""The study's own training."""
READING: Final = "reading-"
OTHER_EXPERIMENTS: Final = ("scalar_only", "wide_prior")
"""Experiments beside the main one that statements ask for."""
RECORDED: Final = ("measurement", "passive", "recording", "reference_prior", "forward_model", "acquisition")
"""What recordings are made, read and calibrated with."""
SIMULATED: Final = ("prior", "forward_model")
"""What the simulations of an experiment depend on."""
FIT: Final = "swesbi.checks.cmaes:reference_fit"
OF_EXPERIMENT: Final = (
    "prior", "forward_model", "measurement", "summary", "observation_model", "support", "posterior",
    "predictive", "recovery",
)  # fmt: skip
"""What posterior, predictive check and recovery depend on, which a judgement repeats in memory."""
POOL: Final = "swesbi.networks.paper.pool:pool_of_features"
TRAIN: Final = "swesbi.networks.paper.training:trained_network"
"""Stages that a variant runs anew."""
Epoch = Literal["best", "last"] | int


class Reading(Settings):
    """One way in which the paper's text can be meant, or its recordings can have been."""

    label: str = Field(min_length=1, description="What tables call it.")
    changes: dict[str, JsonValue] = Field(
        default={},
        description="Other values of the configuration, by key; networks are trained anew.",
    )
    noise: Literal["own", "laboratory"] = Field(
        default="own",
        description="Errors of the recordings: as shipped, or of `acquisition`, as a laboratory has them.",
    )
    epoch: Epoch = Field(default="best", description="Of whose weights the main experiment's network is.")
    recovery: Literal["as_trained", "own_statistics", "own_beat"] = Field(
        default="as_trained",
        description="How the recovery's recordings differ from those of training. own_statistics: their "
        "features are standardised by their own mean and sd. own_beat: passive stiffness runs along each "
        "recording's own beat.",
    )
    cmaes_weights: tuple[float, float, float] | None = Field(
        default=None,
        description="Weights of absolute error, correlation and peak in the loss of CMA-ES; null: as set.",
    )


class StatementsSettings(Settings):
    """The section ``statements``: under what the paper's statements are scored again."""

    trainings: tuple[int, ...] = Field(
        min_length=1, description="Trainings of the networks; 1 is the study's own."
    )
    acquisitions: tuple[int, ...] = Field(
        min_length=1, description="Acquisition seeds of the recordings; 1 is the shipped one."
    )
    cmaes_seeds: tuple[int, ...] = Field(
        min_length=1, description="Runs of each search by CMA-ES. Chosen: three of ten; runs agree."
    )
    readings: dict[str, Reading] = Field(description="Readings by name.")

    @model_validator(mode="after")
    def _check(self) -> Self:
        for name, numbers in (("trainings", self.trainings), ("acquisitions", self.acquisitions)):
            if numbers[0] != 1 or len(set(numbers)) < len(numbers):
                raise ValueError(f"{name} = {list(numbers)}: begin with 1, which is the study's, each once")
        return self

    @property
    def variants(self) -> tuple[str, ...]:
        """Names of all that is judged: trainings, then readings."""
        trainings = (f"{TRAINING}{number}" for number in self.trainings)
        return (*trainings, *(f"{READING}{name}" for name in self.readings))

    def reading(self, variant: str) -> Reading:
        """Return the reading of a variant; a training reads all as configured."""
        own = self.readings.get(variant.removeprefix(READING))
        return Reading(label="as configured") if own is None or variant.startswith(TRAINING) else own

    def seed(self, variant: str, seed: int) -> int:
        """Return the seed of a variant's training: that of the study, or for another training its own."""
        if variant.startswith(TRAINING) and variant != OF_STUDY:
            return integer_seed(seed, "statements", variant)
        return seed


def changed(study: Study, statements: StatementsSettings, variant: str) -> Study:
    """Return the study as a variant reads it; a change of what its simulations are made with is refused."""
    changes = statements.reading(variant).changes
    if not changes:
        return study
    source = f"statements.readings.{variant.removeprefix(READING)}.changes"
    other = study.with_changes(changes, source)
    for name in experiments_of(study):
        own, known = (View(each, {"experiment": name}).together(*SIMULATED) for each in (other, study))
        if own != known:
            raise ConfigError(
                f"{source}: changes the prior or the forward model, but readings are judged on the study's "
                "simulations"
            )
    return other


def own_pool(study: Study, statements: StatementsSettings, variant: str, experiment: str) -> bool:
    """Tell whether a variant has another training set of an experiment than the study."""
    other = changed(study, statements, variant)
    own, known = (plain_settings(POOL, View(each, {"experiment": experiment})) for each in (other, study))
    return own != known


def own_network(study: Study, statements: StatementsSettings, variant: str, experiment: str) -> bool:
    """Tell whether a variant trains an experiment's network anew."""
    again = statements.seed(variant, study.config.seed) != study.config.seed
    return again or own_pool(study, statements, variant, experiment)


def experiments_of(study: Study) -> tuple[str, ...]:
    """Return the main experiment and those that statements set beside it, as far as they are run."""
    run = study.config.experiments_run
    return (study.config.main_experiment, *(name for name in OTHER_EXPERIMENTS if name in run))


def judged_settings(study: Study, statements: StatementsSettings, variant: str) -> dict[str, Any]:
    """Return what the judgement of a variant depends on."""
    other = changed(study, statements, variant)
    of_experiment: Mapping[str, Any] = {
        name: View(other, {"experiment": name}).together(*OF_EXPERIMENT) for name in experiments_of(study)
    }
    reading = statements.reading(variant)
    search: dict[str, Any] = {"seeds": list(statements.cmaes_seeds)}
    if reading.cmaes_weights is not None:
        terms = CurveLossSettings.model_fields
        search["loss"] = dict(zip(terms, reading.cmaes_weights, strict=True))
    acquisitions = statements.acquisitions if variant.startswith(TRAINING) else statements.acquisitions[:1]
    return {
        "variant": variant,
        "cohort_title": study.config.cohort_title,
        "main": study.config.main_experiment,
        "experiments": of_experiment,
        "priors": {name: study.config.experiments[name].prior for name in of_experiment},
        "cmaes": overlay(plain_settings(FIT, View(other, {})), {"search": search}),
        "recorded": View(other, {}).together(*RECORDED),
        "acquisitions": list(acquisitions),
        "reading": reading.to_plain(),
    }


def table_settings(statements: StatementsSettings) -> dict[str, Any]:
    """Return what the tables depend on; readings are shown in the order of their names."""
    return {"labels": {name: statements.readings[name].label for name in sorted(statements.readings)}}
