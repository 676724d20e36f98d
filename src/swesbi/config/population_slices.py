"""Slices of the stages of experiments over a population."""

from __future__ import annotations

from typing import Any

from swesbi.config import speed_slices as speeds
from swesbi.config.errors import ConfigError
from swesbi.config.models import PopulationExperimentSettings
from swesbi.config.parts import Wildcards, common, figure, named, of_experiment, wildcard
from swesbi.config.study import Study
from swesbi.simulations.shards import shard_draws


def simulate(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what a shard of the simulations depends on."""
    section = _section(study, wildcards)
    contexts = _numbers(study, wildcards, "shard", section.simulations.contexts)
    return {
        "contexts": contexts,
        "draws_per_context": section.simulations.draws_per_context,
        "phases": study.config.acquisition.phases,
        "population": section.population.to_plain(),
        "model": speeds.speed_model(study, wildcards),
    }


def train(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what the network depends on."""
    section = _section(study, wildcards)
    return {
        "model": speeds.speed_model(study, wildcards),
        "conditions": section.conditions.to_plain(),
        "estimator": section.estimator.to_plain(),
    } | common(study.config, "acquisition", "recording")


def calibration(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what a part of the recordings of fresh contexts depends on."""
    section = _section(study, wildcards).calibration
    base = of_experiment(study, wildcards, "exact", "calibration")
    return {
        "own": _numbers(study, wildcards, "part", section.own),
        "acquired": _numbers(study, wildcards, "part", section.acquired),
        "fresh": _fresh(study, wildcards),
        "sizes": base["calibration"]["recordings"],
        "exact": base["exact"],
        "refinement": study.config.new_subjects.refinement.to_plain(),
    }


def scores(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what is asked of the answers to fresh contexts."""
    base = of_experiment(study, wildcards, "prior", "calibration")
    strata = _section(study, wildcards).calibration.strata.to_plain()
    return {"prior": base["prior"], "judgement": base["calibration"]["judgement"], "strata": strata}


def null(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what the nulls of the misspecification tests depend on."""
    base = of_experiment(study, wildcards, "summary", "misspecification")
    return {
        "fresh": _fresh(study, wildcards),
        "summary": base["summary"],
        "sizes": _section(study, wildcards).nulls.to_plain(),
        "rule": base["misspecification"]["rule"],
    }


def agreement(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what the comparison with the base experiment's posteriors depends on."""
    draws = _section(study, wildcards).calibration.two_sample_draws
    return {"prior": speeds.speed_model(study, wildcards)["prior"], "draws": draws}


def answers(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what the answers for a batch of subjects depend on."""
    return {
        "exact_posterior": speeds.exact_posterior(study, wildcards),
        "predictive_speeds": speeds.predictive_speeds(study, wildcards),
        "verdict": speeds.verdict(study, wildcards),
        "refinement": study.config.new_subjects.refinement.to_plain(),
        "predictive_recordings": _section(study, wildcards).nulls.predictive_recordings,
    }


def cohort(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what the overview of a cohort depends on: whom it holds, and who of them is refused."""
    _section(study, wildcards)
    name = named(study, wildcards, "experiment")
    shown = {"experiment": name, "refused": study.refused(name)}
    return (
        shown
        | figure(study, wildcards)
        | {
            "contexts": [row.to_plain() for row in study.context_rows.values()],
            "prior": speeds.speed_model(study, wildcards)["prior"],
            "interval": of_experiment(study, wildcards, "exact")["exact"]["interval"],
        }
    )


def strata_figure(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what the figure of strata depends on."""
    _section(study, wildcards)
    interval = of_experiment(study, wildcards, "exact")["exact"]["interval"]
    return {"experiment": named(study, wildcards, "experiment"), "interval": interval}


def training_figure(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what the figure of losses depends on: whose simulations the network was trained on."""
    name = named(study, wildcards, "experiment")
    if name in study.config.population_experiments:
        return {"cohort_title": f"contexts of the population of '{name}'"}
    return figure(study, wildcards)


def _section(study: Study, wildcards: Wildcards) -> PopulationExperimentSettings:
    name = named(study, wildcards, "experiment")
    if name not in study.config.population_experiments:
        known = ", ".join(study.config.population_experiments) or "none"
        raise ConfigError(f"experiment = {name!r}: not one over a population; those are {known}")
    return study.config.population_experiments[name]


def _fresh(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    section = _section(study, wildcards)
    return {
        "population": section.population.to_plain(),
        "conditions": section.conditions.to_plain(),
        "model": speeds.speed_model(study, wildcards),
    } | common(study.config, "acquisition", "recording")


def _numbers(study: Study, wildcards: Wildcards, kind: str, total: int) -> list[int]:
    part = shard_draws(int(wildcard(wildcards, kind)), study.config.resources.population_parts, total)
    return [part.start, part.stop]
