"""What a finished study leaves for those who ask its networks about subjects outside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from swesbi.answers.knowledge import Knowledge, knowledge_of_population, knowledge_of_study
from swesbi.artefacts.atomic import make_command
from swesbi.config.study import Study
from swesbi.networks.flow.files import SHIPPED_NETWORK
from swesbi.study.nulls import nulls_of
from swesbi.verdict.settings import SHIPPED_NULLS


@dataclass(frozen=True)
class FinishedStudy:
    """What a finished experiment on speeds leaves for subjects outside its pool.

    Attributes:
        estimator: The network.
        noise: Noise of the cohort.
        pooled_observations: Observed curves of the cohort.
        null: Null recordings.
    """

    estimator: Path
    noise: Path
    pooled_observations: tuple[Path, ...]
    null: Path
    trained_by: ClassVar[str] = "train_flow"

    @property
    def files(self) -> tuple[Path, ...]:
        """What its network leaves; null recordings may come with the package."""
        return (self.estimator, self.noise, *self.pooled_observations)

    @property
    def is_there(self) -> bool:
        """Whether its network has been trained."""
        return all(path.is_file() for path in self.files)

    def knowledge(self) -> Knowledge:
        """Read what its network knows.

        Raises:
            ArtefactError: A file is no such artefact.
        """
        return knowledge_of_study(self.estimator, self.pooled_observations, self.null)


@dataclass(frozen=True)
class FinishedPopulation:
    """What answers subjects outside the study by a population's network: its own, or the package's.

    Attributes:
        estimator: The network.
        noise: Noise of the study's cohort, where the study has been run.
        null: Null recordings.
    """

    estimator: Path
    noise: Path
    null: Path
    trained_by: ClassVar[str] = "train_population"

    @property
    def files(self) -> tuple[Path, ...]:
        """What its network leaves; null recordings may come with the package."""
        return (self.estimator,)

    @property
    def is_there(self) -> bool:
        """Whether there is such a network."""
        return self.estimator.is_file()

    def knowledge(self) -> Knowledge:
        """Read what its network knows.

        Raises:
            ArtefactError: A file is no such artefact.
        """
        return knowledge_of_population(self.estimator, self.null)


def finished_population(results: Path, experiment: str, null: Path = SHIPPED_NULLS) -> FinishedPopulation:
    """Return where the study keeps what a population's network needs, by the workflow's rules.

    Where the study has not been run, the network of the package answers, if it is of the same model.

    Args:
        results: Folder of the study.
        experiment: Over a population.
        null: Null recordings: those of the package are of the model of its network.
    """
    own = results / experiment / "flow.h5"
    network = SHIPPED_NETWORK if null == SHIPPED_NULLS and not own.is_file() else own
    return FinishedPopulation(network, results / "cohort" / "noise.h5", null)


def finished_study(
    results: Path, experiment: str, subjects: Sequence[str], null: Path = SHIPPED_NULLS
) -> FinishedStudy:
    """Return where the study keeps what a new subject needs, by the names of the workflow's rules."""
    return FinishedStudy(
        estimator=results / experiment / "flow.h5",
        noise=results / "cohort" / "noise.h5",
        pooled_observations=tuple(results / "cohort" / name / "observation.h5" for name in subjects),
        null=null,
    )


def finished_experiment(study: Study, experiment: str) -> FinishedStudy | FinishedPopulation:
    """Return what an experiment leaves for subjects outside its pool, on the cohort or over a population.

    Raises:
        ConfigError: Nothing makes its null recordings.
    """
    results, null = Path(study.config.results), nulls_of(study, experiment)
    if experiment in study.config.population_experiments:
        return finished_population(results, experiment, null)
    return finished_study(results, experiment, study.subjects_of(experiment), null)


def check_finished(study: FinishedStudy | FinishedPopulation, options: str = "") -> None:
    """Refuse a study that has not been run as far as it takes.

    Args:
        study: Its files.
        options: What Snakemake runs it with beside the targets (``--configfile tests/smoke.yaml``, say).

    Raises:
        FileNotFoundError: Names what is missing, and the command that makes it.
    """
    missing = [path for path in (*study.files, study.null) if not path.is_file()]
    if missing:
        raise FileNotFoundError(
            f"{missing[0]} does not exist: the study that is to answer has not been run this far; run\n"
            f"  {make_command(missing, options)}"
        )
