"""The folder of a study that has been run: where its results lie."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from swesbi.answers.knowledge import Knowledge, knowledge_from
from swesbi.artefacts.atomic import make_command
from swesbi.artefacts.typed import FOLDER
from swesbi.config.study import Study
from swesbi.networks.flow.trained import SHIPPED_NETWORK
from swesbi.study.nulls import nulls_of
from swesbi.verdict.settings import SHIPPED_NULLS

OF_POPULATION: Final = "swesbi.population.training:trained_over_population"
OF_COHORT: Final = "swesbi.networks.flow.training:trained_on_subjects"
"""The stages that train networks."""


@dataclass(frozen=True)
class Results:
    """The results of a study, as its rules lay them out."""

    folder: Path

    def of(self, experiment: str, subject: str) -> Path:
        """Return the folder of what an experiment says of a subject."""
        return self.folder / experiment / FOLDER / subject

    @property
    def noise_file(self) -> Path:
        """Where the noise of the cohort lies."""
        return self.folder / "cohort" / "noise.h5"

    def observation_file(self, subject: str) -> Path:
        """Return where the observed curve of a subject lies."""
        return self.folder / "cohort" / subject / "observation.h5"

    def network(self, experiment: str) -> Path:
        """Return where the network of an experiment on speeds or over a population lies."""
        return self.folder / experiment / "flow.h5"


@dataclass(frozen=True)
class ExperimentFiles:
    """What an experiment leaves for subjects outside its cohort.

    Network and null recordings may come with the package. Only an experiment on a cohort has the observed
    curves that its network was trained on, and the noise that it then takes.
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
        """Read what the network knows."""
        return knowledge_from(self.null, self.network, self.observations)

    def check(self, options: str = "") -> None:
        """Refuse to answer by a study that has not been run as far as it takes.

        The error names what is missing and the command that makes it, with what Snakemake is given beside its
        targets.
        """
        missing = [path for path in (*self.files, self.null) if not path.is_file()]
        if missing:
            raise FileNotFoundError(
                f"{missing[0]} does not exist: the study that is to answer has not been run this far; run\n"
                f"  {make_command(missing, options)}"
            )


def experiment_files(study: Study, experiment: str) -> ExperimentFiles:
    """Return what an experiment, of whichever kind, leaves for subjects outside its cohort."""
    results, null = Results(Path(study.config.results)), nulls_of(study, experiment)
    if experiment in study.config.population_experiments:
        return population_files(results, experiment, null)
    observations = tuple(map(results.observation_file, study.subjects_of(experiment)))
    return ExperimentFiles(results.network(experiment), null, observations, results.noise_file)


def population_files(results: Results, experiment: str, null: Path = SHIPPED_NULLS) -> ExperimentFiles:
    """Return what an experiment over a population leaves.

    Where the study has not been run, the network of the package answers, if it is of the same model: that of
    the null recordings of the package.
    """
    own = results.network(experiment)
    return ExperimentFiles(SHIPPED_NETWORK if null == SHIPPED_NULLS and not own.is_file() else own, null)
