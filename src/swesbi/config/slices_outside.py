"""What commands beside the study depend on: subjects outside it, changes, plans."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from swesbi.config.pairs import answered_pairs, left_out, visit_pair
from swesbi.config.parts import Wildcards, named, wildcard
from swesbi.config.read import ConfigError
from swesbi.config.study import Study

Fields = Callable[[Study, Wildcards, str], dict[str, Any]]
"""Returns the values of the sources that a text names, and of other stages (``stage.NAME``)."""


def _one_answer(study: Study, wildcards: Wildcards, fields: Fields) -> dict[str, Any]:
    """Return what the answer to a recording outside the study depends on, a part a step."""
    subject, title = wildcard(wildcards, "subject"), study.config.new_subjects.cohort_title
    parts = fields(
        study.outside,
        wildcards,
        "stage.ingest stage.exact_posterior stage.verdict stage.predictive_speeds clinical "
        "new_subjects.noise_level new_subjects.uninformative",
    )
    said = study.said_of_new(subject)
    parts["ingest"]["recording"] = said.settings.to_plain()
    parts["ingest"]["layout"] = said.file.layout.to_plain()
    shown = "prior=joint_prior experiment.identifiability.difference_step"
    by = f"{shown} draws=experiment.identifiability.design.draws"
    return parts | {"shown": {"cohort_title": title} | fields(study, wildcards, by)}


def _person_change(study: Study, wildcards: Wildcards, fields: Fields) -> dict[str, Any]:
    """Return what a person's change depends on: the model, what visits share, whose visits they are."""
    pair = visit_pair(
        study, wildcard(wildcards, "person"), wildcards.get("from_visit"), wildcards.get("to_visit")
    )
    own = {"person": pair.person, "visits": list(pair.visits)}
    title = {"cohort_title": study.config.new_subjects.cohort_title}
    return own | title | fields(study, wildcards, "model changes")


def _change_groups(study: Study, wildcards: Wildcards, fields: Fields) -> dict[str, Any]:
    """Return what the change in groups depends on beside the changes: groups, and who is left out why."""
    experiment = named(study, wildcards, "experiment")
    group_of = {person.name: person.group for person in study.outside.persons}
    pairs = answered_pairs(study, experiment)
    own = {
        "groups": {pair.person: group_of[pair.person] for pair in pairs if group_of[pair.person]},
        "left_out": list(left_out(study, experiment)),
        "cohort_title": study.config.new_subjects.cohort_title,
    }
    return own | fields(study, wildcards, "prior=joint_prior change_groups cohort_posterior")


PLANNED: Final = ("design", "parameter", "change", "repeats", "repeat_noise")
"""What `python -m swesbi plan` says of a bank."""


def _plan_bank(study: Study, wildcards: Wildcards, fields: Fields) -> dict[str, Any]:
    """Return what the bank of a planned study depends on.

    Raises:
        ConfigError: It is not said what is planned.
    """
    section = study.config.plan
    if unsaid := [name for name in PLANNED if name not in wildcards]:
        raise ConfigError(
            f"plan_bank: {unsaid[0]} is not said; banks are made by `python -m swesbi plan`, which says it"
        )
    experiment = wildcards.get("experiment", section.experiment)
    asked = {
        "design": wildcards["design"],
        "parameter": wildcards["parameter"],
        "change": float(wildcards["change"]),
        "repeats": int(wildcards["repeats"]),
        "repeat_noise": float(wildcards["repeat_noise"]),
        "persons": section.persons.to_plain(),
        "recycled_draws": section.studies.recycled_draws,
    }
    return asked | fields(
        study,
        {"experiment": experiment},
        "model experiment.exact changes acquisition recording measurement.grid_points population.population "
        "lvesv_fraction=experiment.misspecification.rule.volumes.lvesv_tolerance_fraction "
        "stage.train_population",
    )


OUTSIDE: Final[Mapping[str, Callable[[Study, Wildcards, Fields], dict[str, Any]]]] = {
    "person_change": _person_change,
    "change_groups": _change_groups,
    "plan_bank": _plan_bank,
    "one_answer": _one_answer,
}
"""Stages that are no part of the study, and of more than values of the configuration side by side."""
