"""What a stage may depend on, each under one name: settings, facts of the study, a job's wildcards."""

from __future__ import annotations

import json
import operator
from collections.abc import Callable, Mapping
from functools import cache, cached_property
from pathlib import Path
from typing import Any, Final

from swesbi.artefacts.files import hdf5_provenance
from swesbi.base.settings import Settings
from swesbi.config.experiments import (
    ExperimentSettings,
    PopulationExperimentSettings,
    SpeedExperimentSettings,
)
from swesbi.config.models import Config
from swesbi.config.read import ConfigError
from swesbi.config.study import Study
from swesbi.verdict.settings import SHIPPED_NULLS


class View:
    """The study as one job sees it: plain values by name.

    A name stands for a value that is worked out (`WORKED_OUT`), or for a section of the experiment that the
    wildcards name, of its base for one over a population, or for a section of the configuration. Where a
    value lies deeper in such a section, `PATHS` says where.
    """

    def __init__(self, study: Study, wildcards: Mapping[str, str]) -> None:
        self.study, self.wildcards = study, dict(wildcards)
        self.config = study.config

    def __getitem__(self, name: str) -> Any:  # noqa: ANN401
        """Return a plain value.

        A ConfigError is raised where the study lacks what a wildcard names, or the experiment's kind has no
        such section.
        """
        if name in WORKED_OUT:
            return WORKED_OUT[name](self)
        section, _, path = PATHS.get(name, name).partition(".")
        try:
            found = self._section(section)
            return plain(operator.attrgetter(path)(found) if path else found)
        except AttributeError:
            raise ConfigError(
                f"the experiment {self.experiment!r} is of kind {self.of_base.kind!r} and has no {name}; "
                "this stage is for experiments of another kind"
            ) from None

    def _section(self, name: str) -> Any:  # noqa: ANN401
        """Return a section: of an experiment over a population, of its base, or of the configuration."""
        if name == "base":
            return self.of_base
        of_experiment: list[Settings] = []
        if "experiment" in self.wildcards:
            over_population = self.config.population_experiments.get(self.experiment)
            of_experiment = [over_population, self.of_base] if over_population else [self.of_base]
        elif name not in Config.model_fields:
            raise ConfigError(f"{name}: the configuration has no such section; say which experiment")
        holders = (section for section in of_experiment if name in type(section).model_fields)
        return getattr(next(holders, self.config), name)

    def named(self, kind: str) -> str:
        """Return a wildcard; the study must have the subject, experiment or prior that it names."""
        if kind not in self.wildcards:
            raise ConfigError(f"say which {kind}")
        name = self.wildcards[kind]
        known = {
            "subject": self.study.cohort.rows,
            "experiment": (*self.config.experiments, *self.config.population_experiments),
            "prior": self.config.priors,
        }.get(kind, [name])
        if name not in known:
            raise ConfigError(f"{kind} = {name!r}: unknown; the study has {', '.join(known)}")
        return name

    @cached_property
    def experiment(self) -> str:
        """The name of the experiment."""
        return self.named("experiment")

    @property
    def of_base(self) -> ExperimentSettings | SpeedExperimentSettings:
        """The section of the experiment, of its base for one over a population."""
        return self.config.experiments[self.config.base_of(self.experiment)]

    @property
    def population(self) -> PopulationExperimentSettings:
        """The section of an experiment over a population."""
        if self.experiment not in self.config.population_experiments:
            known = ", ".join(self.config.population_experiments) or "none"
            raise ConfigError(
                f"experiment = {self.experiment!r}: not one over a population; those are {known}"
            )
        return self.config.population_experiments[self.experiment]

    def share(self, kind: str, parts: int, total: int) -> list[int]:
        """Return the first of the numbers that fall to one of several jobs, and the one after the last."""
        share = shard_draws(int(self.named(kind)), parts, total)
        return [share.start, share.stop]

    @classmethod
    def of_job(cls, study: Study, wildcards: Mapping[str, str]) -> View:
        """Return the view of a job of the study."""
        view = cls(study, wildcards)
        if {"subject", "experiment"} <= view.wildcards.keys():
            study.check_subject(view.experiment, view.named("subject"))
        return view

    def together(self, *names: str) -> dict[str, Any]:
        """Return several values side by side."""
        return {name: self[name] for name in names}


def nulls_of(study: Study, experiment: str) -> Path:
    """Return the null recordings of an experiment on speeds or over a population.

    They are those that come with the package where these are of the same model: equations, prior, discrepancy
    and operator. Else the study makes its own, by the network of a population with that model.
    """
    model = View(study, {"experiment": experiment})["model"]
    if json.dumps(model, sort_keys=True) == _shipped_model():
        return SHIPPED_NULLS
    populations = study.config.population_experiments
    by = [name for name, one in populations.items() if experiment in (name, one.base)]
    if not by:
        raise ConfigError(
            f"experiment {experiment}: its verdicts need null recordings, and those of the package are of "
            "another prior or forward model; add a population experiment with "
            f"`base: {experiment}`, whose network makes them"
        )
    return Path(study.config.networks or study.config.results) / by[0] / "null.h5"


@cache
def _shipped_model() -> str:
    """Return the model of the null recordings of the package, as the text of its settings."""
    return json.dumps(hdf5_provenance(SHIPPED_NULLS).settings["fresh"]["model"], sort_keys=True)


def shard_draws(shard: int, shards: int, draws: int) -> range:
    """Return the draw numbers of one shard: contiguous, the shards as equal in size as can be."""
    if not 0 <= shard < shards:
        raise ValueError(f"shard {shard} does not exist: there are {shards}, numbered from 0")
    return range(shard * draws // shards, (shard + 1) * draws // shards)


def plain(value: Any) -> Any:  # noqa: ANN401
    """Return a value of the configuration as rules pass it."""
    if isinstance(value, Settings):
        return value.to_plain()
    if isinstance(value, Mapping):
        return {name: plain(one) for name, one in value.items()}
    return list(value) if isinstance(value, tuple) else value


def _prior(view: View) -> dict[str, Any]:
    """Return the prior that a wildcard names, else that of the experiment."""
    name = view.named("prior") if "prior" in view.wildcards else view.of_base.prior
    return view.config.priors[name].to_plain()


def _part_of(path: str, kind: str = "part") -> Callable[[View], list[int]]:
    """Return what gives the numbers, of so many in all, that fall to one job over a population."""
    return lambda view: view.share(
        kind, view.config.resources.population_parts, operator.attrgetter(path)(view.population)
    )


def _draws(view: View) -> list[int]:
    total = view.config.simulations_per_subject(view.named("prior"))
    return view.share("shard", view.config.resources.shards_per_subject, total)


def _visits(view: View) -> dict[str, dict[str, str]]:
    """Return person and group of those subjects of an experiment of whom either is told."""
    visits = {
        subject: view.study.cohort.visits[subject] for subject in view.study.subjects_of(view.experiment)
    }
    return {
        subject: {"person": visit.person, "group": visit.group}
        for subject, visit in visits.items()
        if visit.person or visit.group
    }


def _with_chains(view: View) -> bool:
    """Return whether a subject is among those whose samplers are compared with long chains."""
    chains = view.config.speed_experiments[view.experiment].calibration.local.chains
    return view.named("subject") in view.study.subjects_of(view.experiment)[:chains]


def _cuff(view: View) -> dict[str, Any] | None:
    """Return the errors of the pressures of a subject; None of one without pressures."""
    return view.config.clinical.to_plain() if view.study.has_pressures(view.named("subject")) else None


def _trained_on(view: View) -> str:
    """Return whose simulations a network was trained on."""
    if view.experiment in view.config.population_experiments:
        return f"contexts of the population of '{view.experiment}'"
    return view.config.cohort_title


def _model(view: View) -> dict[str, Any]:
    """Return the model of a recording."""
    return view.together("discrepancy", "density_kg_m3", "forward_model", "measurement") | {
        "prior": view["joint_prior"]
    }


def _configuration(view: View) -> dict[str, Any]:
    """Return the configuration without what changes no result of the study.

    That is where results lie, how the work is split and who else is answered.
    """
    beside = ("resources", "results", "new_subjects", "changes", "change_groups", "plan")
    return {name: value for name, value in view.config.to_plain().items() if name not in beside}


def _experiments_shown(view: View) -> dict[str, Any]:
    """Return the section of each experiment that is run, its prior as the prior itself."""
    return {
        name: view.config.experiments[name].to_plain()
        | {"prior": view.config.priors[view.config.experiments[name].prior].to_plain()}
        for name in view.config.experiments_run
    }


def _populations_shown(view: View) -> dict[str, Any]:
    """Return the section of each experiment over a population, with the mass of its credible intervals."""
    config = view.config
    return {
        name: config.population_experiments[name].to_plain()
        | {"interval": config.speed_experiments[config.base_of(name)].exact.interval}
        for name in config.populations_run
    }


WORKED_OUT: Final[Mapping[str, Callable[[View], Any]]] = {
    "sample_by_sample_numbers": _part_of("calibration.sample_by_sample"),
    "clinical_row": lambda view: view.study.cohort.clinical_of(view.named("subject")).to_plain(),
    "cmaes_prior": lambda view: view.config.priors[view.config.cmaes.prior].to_plain(),
    "cohort_contexts": lambda view: [
        view.study.cohort.rows[subject].to_plain() for subject in view.study.subjects_of(view.experiment)
    ],
    "configuration": _configuration,
    "context": lambda view: view.study.cohort.rows[view.named("subject")].to_plain(),
    "context_numbers": _part_of("simulations.contexts", "shard"),
    "cuff": _cuff,
    "draw_numbers": _draws,
    "experiment": lambda view: view.experiment,
    "experiments_shown": _experiments_shown,
    "fresh": lambda view: view.together("population", "conditions", "model", "acquisition", "recording"),
    "joint_prior": lambda view: {
        "theta": view["prior"], "passive_stiffness_kpa": view["passive_stiffness_kpa"],
    },
    "layout": lambda view: view.study.cohort.layout.to_plain(),
    "model": _model,
    "noise_groups": lambda view: dict(view.study.cohort.noise_groups),
    "model_noise_numbers": _part_of("calibration.model_noise"),
    "population_models": lambda view: {
        name: View(view.study, {"experiment": name})["model"] for name in view.config.populations_run
    },
    "populations_shown": _populations_shown,
    "prior": _prior,
    "pushes_numbers": _part_of("calibration.free_running.recordings"),
    "reference_prior": lambda view: view.config.priors[view.config.passive_reference_prior].to_plain(),
    "refused": lambda view: view.study.refused(view.experiment) if view.population else {},
    "subject": lambda view: view.named("subject"),
    "trained_on": _trained_on,
    "visits": _visits,
    "with_chains": _with_chains,
}  # fmt: skip
"""Values that are no part of the configuration as it stands."""
PATHS: Final[Mapping[str, str]] = {
    "candidate_draws": "epoch_study.candidate_draws",
    "checkpoint_epochs": "epoch_study.checkpoint_epochs",
    "density_kg_m3": "recording.density_kg_m3",
    "difference_step": "identifiability.difference_step",
    "discrepancy": "observation_model.discrepancy",
    "draws_per_context": "simulations.draws_per_context",
    "ejection_time": "misspecification.ejection_time",
    "estimator_model": "estimator.model",
    "free_running": "calibration.free_running",
    "grid_points": "measurement.grid_points",
    "interval": "exact.interval",
    "judgement": "base.calibration.judgement",
    "local": "base.calibration.local",
    "lvesv_fraction": "misspecification.rule.volumes.lvesv_tolerance_fraction",
    "lvet_sd_ms": "clinical.lvet_sd_ms",
    "max_k_hat": "exact.max_k_hat",
    "noise_level": "new_subjects.noise_level",
    "null_sizes": "nulls",
    "phases": "acquisition.phases",
    "recordings": "base.calibration.recordings",
    "repeats_draws": "identifiability.repeats_draws",
    "rule": "misspecification.rule",
    "search": "cmaes.search",
    "doubtful_level": "misspecification.rule.doubtful_level",
    "strata": "calibration.strata",
    "two_sample_draws": "calibration.two_sample_draws",
    "uninformative": "new_subjects.uninformative",
}
"""Where values lie below a section; below that of the base, where one over a population has its own."""
