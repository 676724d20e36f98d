"""Values of the configuration that slices are made of: looked up by a path, or worked out under a name."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from typing import Any, Final

from swesbi.base.settings import Settings
from swesbi.config.experiments import PopulationExperimentSettings
from swesbi.config.read import ConfigError
from swesbi.config.study import Study

Wildcards = Mapping[str, str]
EXPERIMENT: Final = "experiment."
POPULATION: Final = "population."

NUMBERED: Final = ("shard", "part")
"""Wildcards that are numbers; the others are names."""


def shard_draws(shard: int, shards: int, draws: int) -> range:
    """Return the draw numbers of one shard: contiguous, the shards as equal in size as can be.

    Raises:
        ValueError: The shard does not exist.
    """
    if not 0 <= shard < shards:
        raise ValueError(f"shard {shard} does not exist: there are {shards}, numbered from 0")
    return range(shard * draws // shards, (shard + 1) * draws // shards)


def value_of(study: Study, wildcards: Wildcards, source: str) -> Any:  # noqa: ANN401
    """Return the plain value that a source names.

    A source is a key of `NAMED` or of `SIDE_BY_SIDE`; or a dotted path, ``experiment.`` before it in the
    section of the experiment that the wildcard names (of its base, for one over a population);
    ``population.`` in that of an experiment over a population; neither in the configuration as a whole.

    Raises:
        ConfigError: A wildcard is missing or names nothing that the study has, or the experiment is of a kind
            that has no such part.
    """
    if source in NAMED:
        return NAMED[source](study, wildcards)
    if source in SIDE_BY_SIDE:
        return values_of(study, wildcards, SIDE_BY_SIDE[source])
    if source.startswith(EXPERIMENT):
        return _of_experiment(study, wildcards, source.removeprefix(EXPERIMENT))
    if source.startswith(POPULATION):
        return _at(_population(study, wildcards), source.removeprefix(POPULATION))
    return _at(study.config, source)


def values_of(study: Study, wildcards: Wildcards, sources: str) -> dict[str, Any]:
    """Return the values of several sources by field: ``field=source``, or a source that ends on its name."""
    pairs = [assignment.rpartition("=") for assignment in sources.split()]
    return {
        field or source.rsplit(".", maxsplit=1)[-1]: value_of(study, wildcards, source)
        for field, _, source in pairs
    }


def named(study: Study, wildcards: Wildcards, kind: str) -> str:
    """Return a wildcard that must name something of the study: a subject, an experiment, a prior, ...

    Raises:
        ConfigError: It is missing, or the study has no such thing.
    """
    name = wildcard(wildcards, kind)
    known = {
        "subject": study.context_rows,
        "experiment": (*study.config.experiments, *study.config.population_experiments),
        "prior": study.config.priors,
    }
    if name not in known[kind]:
        raise ConfigError(f"{kind} = {name!r}: unknown; the study has {', '.join(known[kind])}")
    return name


def wildcard(wildcards: Wildcards, kind: str) -> str:
    """Return a wildcard, whatever it names.

    Raises:
        ConfigError: It is missing.
    """
    if kind not in wildcards:
        raise ConfigError(f"say which {kind}: {option_of(kind)} {'NUMBER' if kind in NUMBERED else 'NAME'}")
    return wildcards[kind]


def option_of(wildcard: str) -> str:
    """Return the option by which the command line chooses a wildcard; ``--shard`` is a stage's file."""
    return f"--{wildcard}-number" if wildcard in NUMBERED else f"--{wildcard}"


def _at(section: Settings, path: str) -> Any:  # noqa: ANN401
    value = operator.attrgetter(path)(section)
    if isinstance(value, Settings):
        return value.to_plain()
    return list(value) if isinstance(value, tuple) else value


def _of_experiment(study: Study, wildcards: Wildcards, path: str) -> Any:  # noqa: ANN401
    experiment = study.config.experiments[study.config.base_of(named(study, wildcards, "experiment"))]
    part = path.split(".", maxsplit=1)[0]
    if not hasattr(experiment, part):
        raise ConfigError(
            f"the experiment {wildcards['experiment']!r} is of kind {experiment.kind!r} and has no "
            f"{part}; this stage is for experiments of another kind"
        )
    return _at(experiment, path)


def _population(study: Study, wildcards: Wildcards) -> PopulationExperimentSettings:
    name = named(study, wildcards, "experiment")
    if name not in study.config.population_experiments:
        known = ", ".join(study.config.population_experiments) or "none"
        raise ConfigError(f"experiment = {name!r}: not one over a population; those are {known}")
    return study.config.population_experiments[name]


def _prior(study: Study, name: str) -> dict[str, Any]:
    return study.config.priors[name].to_plain()


def _prior_of_experiment(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return _prior(study, _of_experiment(study, wildcards, "prior"))


def _draws_of_shard(study: Study, wildcards: Wildcards) -> list[int]:
    draws = study.config.simulations_per_subject(named(study, wildcards, "prior"))
    return _share(wildcard(wildcards, "shard"), study.config.resources.shards_per_subject, draws)


def _part_of(kind: str, total: str) -> Callable[[Study, Wildcards], list[int]]:
    """Return what gives the numbers, of so many in all, that fall to one job over a population."""

    def numbers(study: Study, wildcards: Wildcards) -> list[int]:
        count = _at(_population(study, wildcards), total)
        return _share(wildcard(wildcards, kind), study.config.resources.population_parts, count)

    return numbers


def _share(number: str, parts: int, total: int) -> list[int]:
    share = shard_draws(int(number), parts, total)
    return [share.start, share.stop]


def _contexts_of_experiment(study: Study, wildcards: Wildcards) -> list[dict[str, Any]]:
    subjects = study.subjects_of(named(study, wildcards, "experiment"))
    return [study.context_rows[subject].to_plain() for subject in subjects]


def _visits_of_experiment(study: Study, wildcards: Wildcards) -> dict[str, dict[str, str]]:
    """Return person and group of those subjects of an experiment of whom either is told."""
    subjects = study.subjects_of(named(study, wildcards, "experiment"))
    visits = {subject: study.visits[subject] for subject in subjects}
    return {
        subject: {"person": visit.person, "group": visit.group}
        for subject, visit in visits.items()
        if visit.person or visit.group
    }


def _with_chains(study: Study, wildcards: Wildcards) -> bool:
    """Return whether a subject is among those whose samplers are compared with long chains."""
    experiment = named(study, wildcards, "experiment")
    chains = study.config.speed_experiments[experiment].calibration.local.chains
    return named(study, wildcards, "subject") in study.subjects_of(experiment)[:chains]


def _title_of_training(study: Study, wildcards: Wildcards) -> str:
    """Return whose simulations a network was trained on."""
    name = named(study, wildcards, "experiment")
    over_population = name in study.config.population_experiments
    return f"contexts of the population of '{name}'" if over_population else study.config.cohort_title


def _name_of_population(study: Study, wildcards: Wildcards) -> str:
    _population(study, wildcards)
    return wildcards["experiment"]


NAMED: Final[Mapping[str, Callable[[Study, Wildcards], Any]]] = {
    "context": lambda study, by: study.context_rows[named(study, by, "subject")].to_plain(),
    "layout": lambda study, _: study.layout.to_plain(),
    "noise_groups": lambda study, _: dict(study.noise_groups),
    "clinical_of_subject": lambda study, by: study.clinical_of(named(study, by, "subject")).to_plain(),
    "contexts_of_experiment": _contexts_of_experiment,
    "visits_of_experiment": _visits_of_experiment,
    "contexts_of_shard": _part_of("shard", "simulations.contexts"),
    "own_of_part": _part_of("part", "calibration.own"),
    "acquired_of_part": _part_of("part", "calibration.acquired"),
    "pushes_of_part": _part_of("part", "calibration.free_running.recordings"),
    "draws_of_shard": _draws_of_shard,
    "prior": _prior_of_experiment,
    "prior_of_cmaes": lambda study, _: _prior(study, study.config.cmaes.prior),
    "prior_simulated": lambda study, by: _prior(study, named(study, by, "prior")),
    "reference_prior": lambda study, _: _prior(study, study.config.passive_reference_prior),
    "name": lambda study, by: named(study, by, "experiment"),
    "name_of_population": _name_of_population,
    "refused": lambda study, by: study.refused(_name_of_population(study, by)),
    "with_chains": _with_chains,
    "title_of_training": _title_of_training,
}
"""Values that are no part of the configuration as it stands."""
SIDE_BY_SIDE: Final[Mapping[str, str]] = {
    "joint_prior": "theta=prior experiment.passive_stiffness_kpa",
    "model": "prior=joint_prior experiment.observation_model.discrepancy recording.density_kg_m3 "
    "forward_model measurement",
    "fresh": "population.population population.conditions model acquisition recording",
}
"""Several values together: the prior of phi, the model of a recording, recordings of fresh contexts."""
