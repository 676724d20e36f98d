"""The folder of a study that has been run: where its results lie, read when they are asked for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from swesbi.answers.knowledge import Knowledge, knowledge_from
from swesbi.artefacts.atomic import make_command
from swesbi.artefacts.typed import FOLDER
from swesbi.config.study import Study
from swesbi.networks.flow.trained import SHIPPED_NETWORK
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.study.nulls import nulls_of
from swesbi.verdict.settings import SHIPPED_NULLS
from swesbi.verdict.verdict import Verdict

OF_POPULATION: Final = "swesbi.population.training:trained_over_population"
OF_COHORT: Final = "swesbi.networks.flow.training:trained_on_subjects"
"""The stages that train networks."""


@dataclass(frozen=True)
class Result:
    """What an experiment on speeds says of one subject."""

    folder: Path

    @property
    def posterior(self) -> ExactPosterior:
        """The exact posterior."""
        return ExactPosterior.read(self.folder / "posterior.h5")

    @property
    def verdict(self) -> Verdict:
        """The verdict, of any experiment."""
        return Verdict.read(self.folder / "verdict.json")


@dataclass(frozen=True)
class Results:
    """The results of a study, as its rules lay them out."""

    folder: Path

    def of(self, experiment: str, subject: str) -> Result:
        """Return what an experiment says of a subject."""
        return Result(self.folder / experiment / FOLDER / subject)

    @property
    def noise_file(self) -> Path:
        """Where the noise of the cohort lies."""
        return self.folder / "cohort" / "noise.h5"

    @property
    def noise(self) -> CohortNoise:
        """The noise of the cohort."""
        return CohortNoise.read(self.noise_file)

    def observation_file(self, subject: str) -> Path:
        """Return where the observed curve of a subject lies."""
        return self.folder / "cohort" / subject / "observation.h5"

    def observation(self, subject: str) -> Observation:
        """Return the observed curve of a subject."""
        return Observation.read(self.observation_file(subject))

    def network(self, experiment: str) -> Path:
        """Return where the network of an experiment on speeds or over a population lies."""
        return self.folder / experiment / "flow.h5"


@dataclass(frozen=True)
class ExperimentFiles:
    """What an experiment leaves for subjects outside its cohort.

    Attributes:
        network: The network: of the study, or of the package where this has not been run.
        null: Null recordings; they may come with the package.
        observations: Observed curves of the cohort that it was trained on; none over a population.
        noise: Noise of this cohort, which it then takes; None over a population.
    """

    network: Path
    null: Path
    observations: tuple[Path, ...] = ()
    noise: Path | None = None

    @property
    def files(self) -> tuple[Path, ...]:
        """What the network leaves."""
        return tuple(filter(None, (self.network, self.noise, *self.observations)))

    @property
    def is_there(self) -> bool:
        """Whether there is such a network, with what it takes."""
        return all(path.is_file() for path in self.files)

    @property
    def trained_by(self) -> str:
        """The stage that trains the network."""
        return OF_POPULATION if self.noise is None else OF_COHORT

    def knowledge(self) -> Knowledge:
        """Read what the network knows.

        Raises:
            ArtefactError: A file is no such artefact.
        """
        return knowledge_from(self.null, self.network, self.observations)

    def check(self, options: str = "") -> None:
        """Refuse to answer by a study that has not been run as far as it takes.

        Args:
            options: What Snakemake runs it with beside the targets (``--configfile tests/smoke.yaml``, say).

        Raises:
            FileNotFoundError: Names what is missing, and the command that makes it.
        """
        missing = [path for path in (*self.files, self.null) if not path.is_file()]
        if missing:
            raise FileNotFoundError(
                f"{missing[0]} does not exist: the study that is to answer has not been run this far; run\n"
                f"  {make_command(missing, options)}"
            )


def experiment_files(study: Study, experiment: str) -> ExperimentFiles:
    """Return what an experiment leaves for subjects outside its cohort, on the cohort or over a population.

    Raises:
        ConfigError: Nothing makes its null recordings.
    """
    results, null = Results(Path(study.config.results)), nulls_of(study, experiment)
    if experiment in study.config.population_experiments:
        return population_files(results, experiment, null)
    observations = tuple(map(results.observation_file, study.subjects_of(experiment)))
    return ExperimentFiles(results.network(experiment), null, observations, results.noise_file)


def population_files(results: Results, experiment: str, null: Path = SHIPPED_NULLS) -> ExperimentFiles:
    """Return what an experiment over a population leaves.

    Where the study has not been run, the network of the package answers, if it is of the same model.

    Args:
        results: Of the study.
        experiment: Over a population.
        null: Null recordings: those of the package are of the model of its network.
    """
    own = results.network(experiment)
    return ExperimentFiles(SHIPPED_NETWORK if null == SHIPPED_NULLS and not own.is_file() else own, null)
