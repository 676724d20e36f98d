"""Parts of the configuration, and the names that wildcards must have, from which slices are made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from swesbi.config.errors import ConfigError
from swesbi.config.models import Config
from swesbi.config.study import Study

Wildcards = Mapping[str, str]


def common(config: Config, *names: str) -> dict[str, Any]:
    """Return parts of the configuration that are the same for every experiment."""
    return {name: getattr(config, name).to_plain() for name in names}


def of_experiment(study: Study, wildcards: Wildcards, *names: str) -> dict[str, Any]:
    """Return parts of one experiment's section; its prior as the prior itself, not its name.

    An experiment over a population has those of its base.
    """
    config = study.config
    experiment = config.experiments[config.base_of(named(study, wildcards, "experiment"))]
    plain = experiment.to_plain() | {"prior": config.priors[experiment.prior].to_plain()}
    if missing := [name for name in names if name not in plain]:
        raise ConfigError(
            f"the experiment {wildcards['experiment']!r} is of kind {experiment.kind!r} and has no "
            f"{missing[0]}; this stage is for experiments of another kind"
        )
    return {name: plain[name] for name in names}


def figure(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what every figure depends on: what it calls the subjects."""
    return {"cohort_title": study.config.cohort_title}


def context_of(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return the row of the subject that a wildcard names."""
    return study.context_rows[named(study, wildcards, "subject")].to_plain()


def named(study: Study, wildcards: Wildcards, kind: str) -> str:
    """Return a wildcard that must name a subject, an experiment or a prior of the study."""
    name = wildcard(wildcards, kind)
    known = {
        "subject": study.context_rows,
        "experiment": (*study.config.experiments, *study.config.population_experiments),
        "prior": study.config.priors,
        "variant": study.config.sensitivity.variants,
    }
    if name not in known[kind]:
        raise ConfigError(f"{kind} = {name!r}: unknown; the study has {', '.join(known[kind])}")
    return name


def wildcard(wildcards: Wildcards, kind: str) -> str:
    """Return a wildcard that must be there."""
    if kind not in wildcards:
        raise ConfigError(f"say which {kind}: --{kind} NAME")
    return wildcards[kind]
