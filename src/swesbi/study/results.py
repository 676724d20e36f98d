"""The folder of a study that has been run: where its results lie, and by which settings it was trained."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from swesbi.answers.answer import Knowledge, knowledge_from
from swesbi.artefacts.atomic import make_command
from swesbi.base.settings import flatten
from swesbi.config.study import Study
from swesbi.config.view import nulls_of
from swesbi.networks.flow.trained import SHIPPED_NETWORK, TrainedFlow
from swesbi.verdict.settings import SHIPPED_NULLS

OF_POPULATION: Final = "swesbi.population.training:trained_over_population"
OF_COHORT: Final = "swesbi.networks.flow.training:trained_on_subjects"
"""The stages that train networks."""
NETWORK: Final = "flow.h5"
"""In the folder of an experiment on speeds or over a population."""
ABSENT: Final = str(None)
NAME: Final = "experiment"
"""The setting by which progress lines call a training."""


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
    results, null = Path(study.config.results), nulls_of(study, experiment)
    if experiment in study.config.population_experiments:
        return population_files(results, experiment, null)
    cohort = results / "cohort"
    observations = tuple(cohort / name / "observation.h5" for name in study.subjects_of(experiment))
    return ExperimentFiles(results / experiment / NETWORK, null, observations, cohort / "noise.h5")


def population_files(results: Path, experiment: str, null: Path = SHIPPED_NULLS) -> ExperimentFiles:
    """Return what an experiment over a population leaves in the folder of the results.

    Where the study has not been run, the network of the package answers, if it is of the same model: that of
    the null recordings of the package.
    """
    own = results / experiment / NETWORK
    return ExperimentFiles(SHIPPED_NETWORK if null == SHIPPED_NULLS and not own.is_file() else own, null)


class OtherNetworkError(ValueError):
    """The network was trained under other settings than these."""


def check_network(estimator: Path, settings: Mapping[str, Any]) -> None:
    """Refuse a network that was trained under other settings than those of the configuration.

    A setting that is null is one that is not there, as in a network trained before there was such a setting.
    The network of the package is of the shipped recordings; under another protocol it proposes less well, and
    weights correct it. So of its settings the model alone must be that of the configuration.
    """
    trained = TrainedFlow.load(estimator)[1].settings
    if estimator == SHIPPED_NETWORK:
        settings, trained = ({"model": each["model"]} for each in (settings, trained))
    if fault := difference(trained, settings):
        raise OtherNetworkError(f"{estimator}: {fault}")


def difference(trained: Mapping[str, Any], settings: Mapping[str, Any]) -> str:
    """Return the first setting in which a network was trained otherwise, in words; empty if there is none."""
    here, there = (
        flatten({key: value for key, value in each.items() if key != NAME}) for each in (settings, trained)
    )
    for key in sorted(here.keys() | there.keys()):
        if here.get(key, ABSENT) != there.get(key, ABSENT):
            return (
                f"was trained with {key} = {there.get(key)}, the configuration has {here.get(key)}; run the "
                "study again, or use the configuration that it was trained with"
            )
    return ""
