"""Settings of the validation: which hearts are asked for, and when a share says something."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

from pydantic import Field, model_validator

from studies.section import check_experiment
from studies.validation.hearts.recording import DEVELOPMENT, VALIDATION_STREAM
from swesbi.answers.answer import AnswerSettings
from swesbi.base.settings import Settings
from swesbi.config.read import parse_section, read_yaml
from swesbi.config.study import Study
from swesbi.config.view import View
from swesbi.study.results import OF_POPULATION
from swesbi.study.stage import plain_settings

ANSWERED: Final = (
    *AnswerSettings.model_fields, "prior", "noise_level", "population", "acquisition", "recording",
    "grid_points",
)  # fmt: skip
"""What answers depend on beside whose hearts are asked for."""
NONSENSE_STREAM: Final = "nonsense"
"""Name of the random streams of curves that no heart makes."""
CONFIGURED: Final = Path(__file__).with_name("config.yaml")
Letter = Literal["a", "b", "c", "d", "e", "f", "g", "h", "p"]
Hearts = Annotated[int, Field(ge=1)]


class ScoreSettings(Settings):
    """When an interval is asked, and how certain a share is."""

    least_not_contradicted: int = Field(
        ge=1, description="A generator with fewer hearts that are not contradicted is not tested (README.md)."
    )
    confidence: float = Field(gt=0, lt=1, description="Level of the Clopper-Pearson intervals of rates.")


class ValidationSettings(Settings):
    """Which hearts are asked for, and how they are counted: the section `validation` of config.yaml."""

    experiment: str = Field(min_length=1, description="An experiment over a population.")
    stream: str = Field(
        min_length=1,
        description="Name of the random streams, which decides what the hearts are. Any other name gives "
        "hearts of development.",
    )
    generators: tuple[Letter, ...] = Field(min_length=1, description="Whose hearts are asked for.")
    hearts: dict[Letter, Hearts] = Field(
        min_length=1,
        description="Number of hearts by generator. README.md; written down before anything was tuned.",
    )
    hearts_per_job: int = Field(
        ge=1,
        description="Hearts that a job answers; changes no answer. Chosen: a stopped run loses so many at "
        "most, and the last job does not go on alone for long.",
    )
    nonsense: int = Field(
        ge=1, description="Hearts of (a) of which curves are made that no heart makes. README.md."
    )
    score: ScoreSettings = Field(description="How answers are counted.")

    @model_validator(mode="after")
    def _check_generators(self) -> Self:
        for letter in self.generators:
            if letter not in self.hearts:
                raise ValueError(f"hearts.{letter}: is not said, though {letter!r} is among the generators")
            if self.stream == VALIDATION_STREAM and letter in DEVELOPMENT:
                raise ValueError(
                    f"generators: {letter!r} is of development, in no validation; give `stream` another name"
                )
        return self

    def parts(self, letter: Letter) -> range:
        """Return the numbers of the jobs that answer the hearts of a generator."""
        return self.parts_of(self.hearts[letter])

    def parts_of(self, hearts: int) -> range:
        """Return the numbers of the jobs that answer so many hearts."""
        return range(-(-hearts // self.hearts_per_job))

    def numbers(self, hearts: int, part: int) -> range:
        """Return the numbers of the hearts, of so many, that a job answers."""
        first = part * self.hearts_per_job
        return range(first, min(first + self.hearts_per_job, hearts))


def configured() -> ValidationSettings:
    """Return the section of config.yaml beside this file."""
    return parse_section(read_yaml(CONFIGURED)["validation"], str(CONFIGURED), ValidationSettings)


def answers_settings(
    study: Study, experiment: str, generator: str, stream: str, numbers: range
) -> dict[str, Any]:
    """Return what the answers to the hearts of these numbers depend on; the experiment has a population."""
    check_experiment("validation", experiment, study.config.population_experiments, "over a population")
    asked = {"generator": generator, "stream": stream, "first": numbers.start, "hearts": len(numbers)}
    view = View(study, {"experiment": experiment})
    trained = plain_settings(OF_POPULATION, view)
    return asked | view.together(*ANSWERED) | {"train_population": trained}


def table_settings(study: Study, validation: ValidationSettings) -> dict[str, Any]:
    """Return what tables and figure depend on."""
    shown = View(study, {"experiment": validation.experiment}).together("interval")
    return shown | {"score": validation.score.to_plain()}
