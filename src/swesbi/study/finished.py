"""What a finished study leaves for those who ask its networks about subjects outside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from swesbi.answers.knowledge import Knowledge, knowledge_of_population, knowledge_of_study
from swesbi.artefacts.atomic import make_command
from swesbi.config.study import Study
from swesbi.verdict.settings import RuleSettings


@dataclass(frozen=True)
class FinishedStudy:
    """What a finished experiment on speeds leaves for subjects outside its pool.

    Attributes:
        estimator: The network.
        noise: Noise of the cohort.
        pooled_observations: Observed curves of the cohort.
        misspecifications: Null distributions of the cohort.
    """

    estimator: Path
    noise: Path
    pooled_observations: tuple[Path, ...]
    misspecifications: tuple[Path, ...]
    trained_by: ClassVar[str] = "train_flow"

    @property
    def files(self) -> tuple[Path, ...]:
        """All of them."""
        return (self.estimator, self.noise, *self.pooled_observations, *self.misspecifications)

    @property
    def is_there(self) -> bool:
        """Whether all of it has been made."""
        return all(path.is_file() for path in self.files)

    def knowledge(self, rule: RuleSettings) -> Knowledge:
        """Read what its network knows; ``rule`` says how null distributions are taken together.

        Raises:
            ArtefactError: A file is no such artefact.
        """
        return knowledge_of_study(self.estimator, self.pooled_observations, self.misspecifications, rule)


@dataclass(frozen=True)
class FinishedPopulation:
    """What a finished experiment over a population leaves for subjects outside the study.

    Attributes:
        estimator: The network.
        noise: Noise of the study's cohort.
        null: Null recordings of the population.
    """

    estimator: Path
    noise: Path
    null: Path
    trained_by: ClassVar[str] = "train_population"

    @property
    def files(self) -> tuple[Path, ...]:
        """All of them."""
        return (self.estimator, self.noise, self.null)

    @property
    def is_there(self) -> bool:
        """Whether all of it has been made."""
        return all(path.is_file() for path in self.files)

    def knowledge(self, rule: RuleSettings | None = None) -> Knowledge:
        """Read what its network knows; its null distributions are together already.

        Raises:
            ArtefactError: A file is no such artefact.
        """
        return knowledge_of_population(self.estimator, self.null)


def finished_population(results: Path, experiment: str) -> FinishedPopulation:
    """Return where the study keeps what a population's network needs, by the workflow's rules."""
    inferred = results / experiment
    return FinishedPopulation(inferred / "flow.h5", results / "cohort" / "noise.h5", inferred / "null.h5")


def finished_study(results: Path, experiment: str, subjects: Sequence[str]) -> FinishedStudy:
    """Return where the study keeps what a new subject needs, by the names of the workflow's rules."""
    cohort, inferred = results / "cohort", results / experiment
    return FinishedStudy(
        estimator=inferred / "flow.h5",
        noise=cohort / "noise.h5",
        pooled_observations=tuple(cohort / name / "observation.h5" for name in subjects),
        misspecifications=tuple(inferred / "subjects" / name / "misspecification.h5" for name in subjects),
    )


def finished_experiment(study: Study, experiment: str) -> FinishedStudy | FinishedPopulation:
    """Return what an experiment leaves for subjects outside its pool, on the cohort or over a population."""
    results = Path(study.config.results)
    if experiment in study.config.population_experiments:
        return finished_population(results, experiment)
    return finished_study(results, experiment, study.subjects_of(experiment))


def check_finished(study: FinishedStudy | FinishedPopulation, options: str = "") -> None:
    """Refuse a study that has not been run as far as it takes.

    Args:
        study: Its files.
        options: What Snakemake runs it with beside the targets (``--configfile tests/smoke.yaml``, say).

    Raises:
        FileNotFoundError: Names what is missing, and the command that makes it.
    """
    missing = [path for path in study.files if not path.is_file()]
    if missing:
        raise FileNotFoundError(
            f"{missing[0]} does not exist: the study that is to answer has not been run this far; run\n"
            f"  {make_command(missing, options)}"
        )
