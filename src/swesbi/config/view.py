"""What a stage may depend on, each under one name: settings, facts of the study, a job's wildcards."""

from __future__ import annotations

from functools import cached_property
from typing import Any, Final

from swesbi.config.parts import NAMED, SIDE_BY_SIDE, Wildcards, named, value_of
from swesbi.config.read import ConfigError
from swesbi.config.study import Study

PLACES: Final = {
    "acquired_numbers": "acquired_of_part",
    "candidate_draws": "experiment.epoch_study.candidate_draws",
    "checkpoint_epochs": "experiment.epoch_study.checkpoint_epochs",
    "clinical_row": "clinical_of_subject",
    "cmaes_prior": "prior_of_cmaes",
    "cohort_contexts": "contexts_of_experiment",
    "context_numbers": "contexts_of_shard",
    "draw_numbers": "draws_of_shard",
    "draws_per_context": "population.simulations.draws_per_context",
    "ejection_time": "experiment.misspecification.ejection_time",
    "estimator_model": "experiment.estimator.model",
    "free_running": "population.calibration.free_running",
    "interval": "experiment.exact.interval",
    "judgement": "experiment.calibration.judgement",
    "local": "experiment.calibration.local",
    "lvet_sd_ms": "clinical.lvet_sd_ms",
    "max_k_hat": "experiment.exact.max_k_hat",
    "null_sizes": "population.nulls",
    "own_numbers": "own_of_part",
    "phases": "acquisition.phases",
    "pushes_numbers": "pushes_of_part",
    "recordings": "experiment.calibration.recordings",
    "rule": "experiment.misspecification.rule",
    "search": "cmaes.search",
    "strained_level": "experiment.misspecification.rule.strained_level",
    "strata": "population.calibration.strata",
    "trained_on": "title_of_training",
    "two_sample_draws": "population.calibration.two_sample_draws",
    "uninformative": "new_subjects.uninformative",
    "visits": "visits_of_experiment",
}
"""Names of values that lie elsewhere, as :func:`swesbi.config.parts.value_of` takes them."""


class View:
    """The study as one job sees it: plain values by name.

    A name stands for a value that is worked out, else for a section of the experiment that the wildcards
    name, of its base for one over a population, else for a section of the configuration.

    Attributes:
        study: The study.
        wildcards: Of the job: subject, experiment, ...
    """

    def __init__(self, study: Study, wildcards: Wildcards) -> None:
        self.study, self.wildcards = study, dict(wildcards)

    def __getitem__(self, name: str) -> Any:  # noqa: ANN401
        """Return a plain value.

        Raises:
            ConfigError: A wildcard is missing or names nothing that the study has, the experiment is of a
                kind that has no such section, or does not answer the subject.
        """
        if {"subject", "experiment"} <= self.wildcards.keys():
            self.study.check_subject(self._experiment, named(self.study, self.wildcards, "subject"))
        if name in ("experiment", "subject"):
            return named(self.study, self.wildcards, name)
        if name == "prior" and "prior" in self.wildcards:
            return value_of(self.study, self.wildcards, "prior_simulated")
        return value_of(self.study, self.wildcards, self._place(name))

    def _place(self, name: str) -> str:
        if name in PLACES:
            return PLACES[name]
        if name in NAMED or name in SIDE_BY_SIDE:
            return name
        config = self.study.config
        if "experiment" in self.wildcards:
            if self._experiment in config.population_experiments and hasattr(
                config.population_experiments[self._experiment], name
            ):
                return f"population.{name}"
            if hasattr(config.experiments[config.base_of(self._experiment)], name):
                return f"experiment.{name}"
        if not hasattr(config, name):
            raise ConfigError(f"{name}: there is no such setting for {self.wildcards or 'the whole cohort'}")
        return name

    @cached_property
    def _experiment(self) -> str:
        return named(self.study, self.wildcards, "experiment")
