"""Which part of the configuration each stage depends on: what its rule is rerun for, and nothing else.

Every slice is plain data with the fields of the stage's own settings class.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from swesbi.config.parts import Wildcards, named, values_of
from swesbi.config.read import ConfigError
from swesbi.config.slices_outside import OUTSIDE
from swesbi.config.study import Study

SOURCES: Final[Mapping[str, str]] = {
    "ingest": "context clinical=clinical_of_subject recording measurement layout",
    "noise": "recording noise layout noise_groups",
    "passive": "prior=reference_prior forward_model passive measurement",
    "simulate": "draws=draws_of_shard context prior=prior_simulated forward_model",
    "population_simulate": "contexts=contexts_of_shard population.simulations.draws_per_context "
    "population.population phases=acquisition.phases model",
    "pool": "experiment.summary experiment.observation_model experiment.simulations_per_subject measurement",
    "speed_pool": "experiment.simulations_per_subject measurement",
    "train": "experiment.epoch_study.checkpoint_epochs experiment.estimator prior",
    "train_flow": "experiment.estimator experiment.summary model",
    "train_population": "population.conditions population.estimator model acquisition recording",
    "posterior": "experiment.support experiment.posterior prior",
    "recovery": "experiment.summary experiment.observation_model experiment.recovery prior forward_model "
    "measurement",
    "recovery_acquisition": "experiment.summary experiment.recovery prior acquisition forward_model "
    "measurement passive recording passive_reference_prior=reference_prior",
    "epochs": "experiment.support experiment.predictive experiment.epoch_study.candidate_draws "
    "experiment.summary experiment.observation_model experiment.recovery prior forward_model measurement",
    "predictive": "experiment.summary experiment.observation_model experiment.predictive forward_model "
    "measurement",
    "predictive_speeds": "experiment.summary experiment.predictive model",
    "cmaes": "cmaes.search prior=prior_of_cmaes forward_model measurement",
    "exact_posterior": "experiment.exact model",
    "calibration_recordings": "experiment.exact experiment.calibration.recordings model acquisition "
    "recording",
    "calibration_local": "experiment.exact experiment.calibration.local model with_chains",
    "calibration": "prior experiment.calibration.judgement experiment.misspecification.rule",
    "verdict": "experiment.misspecification.rule experiment.misspecification.ejection_time "
    "clinical.lvet_sd_ms model",
    "population_calibration": "own=own_of_part acquired=acquired_of_part experiment.exact "
    "sizes=experiment.calibration.recordings fresh",
    "population_scores": "prior experiment.calibration.judgement population.calibration.strata "
    "experiment.misspecification.rule",
    "pushes_calibration": "index=pushes_of_part population.calibration.free_running experiment.exact "
    "sizes=experiment.calibration.recordings fresh",
    "pushes_table": "prior=joint_prior experiment.calibration.judgement experiment.misspecification.rule",
    "population_null": "experiment.exact fresh sizes=population.nulls",
    "population_agreement": "draws=population.calibration.two_sample_draws prior=joint_prior",
    "population_answers": "stage.exact_posterior stage.predictive_speeds stage.verdict "
    "new_subjects.uninformative",
    "cohort_posterior": "model experiment.exact cohort_posterior visits=visits_of_experiment",
    "cohort_posterior_figure": "cohort_title",
    "pressures": "stage.exact_posterior clinical",
    "pressures_table": "",
    "pressures_figure": "experiment=name_of_population cohort_title",
    "population_cohort": "experiment=name_of_population refused cohort_title "
    "contexts=contexts_of_experiment prior=joint_prior "
    "experiment.exact.interval",
    "identifiability": "experiment.identifiability model",
    "identifiability_figures": "cohort_title",
    "subject_figures": "cohort_title prior",
    "exact_subject_figures": "cohort_title prior=joint_prior",
    "cohort_figures": "cohort_title prior",
    "exact_figures": "cohort_title prior=joint_prior",
    "workflow_figure": "cohort_title prior estimator=experiment.estimator.model",
    "training_figure": "cohort_title=title_of_training",
    "misspecification_figure": "cohort_title experiment.misspecification.rule.strained_level",
    "calibration_figure": "experiment=name experiment.exact.max_k_hat experiment.calibration.judgement "
    "cohort_title",
    "strata_figure": "experiment=name_of_population experiment.exact.interval",
    "tables": "cohort_title",
    "truth": "",
}
"""Fields of each stage's settings: ``field=source``, or the source alone where it ends on the field's name.

`value_of` says what a source is; ``stage.`` before a name stands for the settings of that stage.
"""
ONE_ANSWER: Final = "one_answer"
"""What the answer to a recording outside the study depends on; no stage of the study."""
OF_PERSONS: Final = ("person_change", "change_groups")
"""Stages of persons outside the study."""
STAGE: Final = "stage."
FIGURE: Final = "_figure"
SHARED_BY_FIGURES: Final = "cohort_title"
"""Sources of a stage whose name ends on `FIGURE` and that has none of its own."""


def stage_settings(study: Study, stage: str, **wildcards: str) -> dict[str, Any]:
    """Return the plain, key-sorted settings of a stage under these wildcards (subject, experiment, ...).

    Raises:
        ConfigError: A wildcard is missing or names nothing that the study has, or the subject is not one
            of the experiment's.
        KeyError: There is no such stage.
    """
    if {"subject", "experiment"} <= wildcards.keys() and stage != ONE_ANSWER:
        study.check_subject(named(study, wildcards, "experiment"), named(study, wildcards, "subject"))
    return dict(sorted(_slice(study, wildcards, stage).items()))


def _slice(study: Study, wildcards: Wildcards, stage: str) -> dict[str, Any]:
    if stage in COMPOSED:
        return COMPOSED[stage](study, wildcards)
    if stage.endswith(FIGURE):
        return fields_of(study, wildcards, SOURCES.get(stage, SHARED_BY_FIGURES))
    return fields_of(study, wildcards, SOURCES[stage])


def fields_of(study: Study, wildcards: Wildcards, sources: str) -> dict[str, Any]:
    """Return the plain values of sources by field, as `SOURCES` writes them.

    Raises:
        As ``value_of``.
    """
    asked = sources.split()
    stages = [source.removeprefix(STAGE) for source in asked if source.startswith(STAGE)]
    composed = {stage: _slice(study, wildcards, stage) for stage in stages}
    beside = " ".join(source for source in asked if not source.startswith(STAGE))
    return composed | values_of(study, wildcards, beside)


def _paper_comparison(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    names = ("observation_model", "estimator", "support", "predictive", "recovery")
    own = fields_of(study, wildcards, " ".join(["prior", *(f"experiment.{name}" for name in names)]))
    general = "cmaes=cmaes.search cohort_title main_experiment=name recording"
    return fields_of(study, wildcards, general) | {"experiment": own}


def _report(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    config = study.config
    shown = {
        name: config.experiments[name].to_plain()
        | {"prior": config.priors[config.experiments[name].prior].to_plain()}
        for name in config.experiments_run
    }
    populations = {
        name: config.population_experiments[name].to_plain()
        | {"interval": config.speed_experiments[config.base_of(name)].exact.interval}
        for name in config.populations_run
    }
    # where results lie, how the work is split and who else is answered change no result of the study
    printed = config.to_plain()
    for key in ("resources", "results", "new_subjects", "changes", "change_groups", "plan"):
        del printed[key]
    return {
        "cohort_title": config.cohort_title,
        "configuration": printed,
        "experiments": shown,
        "main_experiment": config.main_experiment,
        "populations": populations,
    }


def _outside(name: str, study: Study, wildcards: Wildcards) -> dict[str, Any]:
    if name in (ONE_ANSWER, *OF_PERSONS) and not (study.new_rows or study.new_refused):
        command = "compare" if name in OF_PERSONS else "infer"
        raise ConfigError(
            f"{name}: no folder of recordings outside the study is named; `swesbi {command} --cohort FOLDER` "
            "runs this stage"
        )
    return OUTSIDE[name](study, wildcards, fields_of)


COMPOSED: Final[Mapping[str, Callable[[Study, Wildcards], dict[str, Any]]]] = {
    "paper_comparison": _paper_comparison,
    "report": _report,
    **{name: partial(_outside, name) for name in OUTSIDE},
}
"""Stages whose settings are more than values of the configuration side by side."""
