"""Which part of the configuration each stage depends on: what its rule is rerun for, and nothing else.

Every slice is plain data with the fields of the stage's own settings class.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Final

from swesbi.config import population_slices as populations
from swesbi.config import speed_slices as speeds
from swesbi.config.parts import Wildcards, common, context_of, figure, named, of_experiment, wildcard
from swesbi.config.study import Study
from swesbi.simulations.shards import shard_draws

Slice = Callable[[Study, Wildcards], dict[str, Any]]


def stage_settings(study: Study, stage: str, **wildcards: str) -> dict[str, Any]:
    """Return the plain, key-sorted settings of a stage under these wildcards (subject, experiment, ...).

    Raises:
        ConfigError: A wildcard is missing or names nothing that the study has.
        KeyError: There is no such stage.
    """
    return dict(sorted(_SLICES[stage](study, wildcards).items()))


def _ingest(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return {"context": context_of(study, wildcards)} | common(study.config, "recording", "measurement")


def _ingest_batch(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    batch = study.batches(study.subjects)[int(wildcard(wildcards, "batch"))]
    rows = [study.context_rows[subject].to_plain() for subject in batch]
    return {"contexts": rows} | common(study.config, "recording", "measurement")


def _noise(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return common(study.config, "recording", "noise")


def _passive(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    prior = study.config.priors[study.config.passive_reference_prior]
    return {"prior": prior.to_plain()} | common(study.config, "forward_model", "passive", "measurement")


def _simulate(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    config, prior = study.config, named(study, wildcards, "prior")
    draws = config.simulations_per_subject(prior)
    shard = shard_draws(int(wildcard(wildcards, "shard")), config.resources.shards_per_subject, draws)
    return {
        "context": context_of(study, wildcards),
        "draws": [shard.start, shard.stop],
        "prior": config.priors[prior].to_plain(),
    } | common(config, "forward_model")


def _pool(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return common(study.config, "measurement") | of_experiment(
        study, wildcards, "summary", "observation_model", "simulations_per_subject"
    )


def _train(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    epoch_study = of_experiment(study, wildcards, "epoch_study")["epoch_study"]
    own = of_experiment(study, wildcards, "estimator", "prior")
    return own | {"checkpoint_epochs": epoch_study["checkpoint_epochs"]}


def _posterior(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return of_experiment(study, wildcards, "support", "posterior", "prior")


def _predictive(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    experiment = of_experiment(study, wildcards, "summary", "observation_model", "predictive")
    return experiment | common(study.config, "forward_model", "measurement")


def _recovery(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    experiment = of_experiment(study, wildcards, "summary", "observation_model", "recovery", "prior")
    return experiment | common(study.config, "forward_model", "measurement")


def _recovery_acquisition(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    general = common(study.config, "acquisition", "forward_model", "measurement", "passive", "recording")
    reference = study.config.priors[study.config.passive_reference_prior].to_plain()
    own = of_experiment(study, wildcards, "summary", "recovery", "prior")
    return general | own | {"passive_reference_prior": reference}


def _epochs(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    own = of_experiment(study, wildcards, "support", "predictive", "epoch_study")
    draws = own.pop("epoch_study")["candidate_draws"]
    return _recovery(study, wildcards) | own | {"candidate_draws": draws}


def _epochs_figure(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    name = named(study, wildcards, "experiment")
    interval = study.config.experiments[name].predictive.interval
    return figure(study, wildcards) | {"experiment": name, "interval": interval}


def _acquisition_seeds(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    general = common(study.config, "forward_model", "measurement", "passive", "recording")
    reference = study.config.priors[study.config.passive_reference_prior].to_plain()
    own = of_experiment(study, wildcards, "summary", "support", "predictive", "prior")
    seeds = list(study.config.acquisition_seeds.seeds)
    return general | own | {"passive_reference_prior": reference, "seeds": seeds}


def _misspecification_figure(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    rule = speeds.misspecification_table(study, wildcards)["rule"]
    return figure(study, wildcards) | {"strained_level": rule["strained_level"]}


def _identifiability_figures(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    named(study, wildcards, "experiment")
    return figure(study, wildcards)


def _calibration_figure(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    own = of_experiment(study, wildcards, "exact", "calibration")
    shown = {"judgement": own["calibration"]["judgement"], "max_k_hat": own["exact"]["max_k_hat"]}
    return figure(study, wildcards) | shown | {"experiment": named(study, wildcards, "experiment")}


def _cmaes(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    config = study.config
    own = {"search": config.cmaes.search.to_plain(), "prior": config.priors[config.cmaes.prior].to_plain()}
    return own | common(config, "forward_model", "measurement")


def _figure_with_prior(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return figure(study, wildcards) | of_experiment(study, wildcards, "prior")


def _exact_figures(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return figure(study, wildcards) | {"prior": speeds.speed_model(study, wildcards)["prior"]}


def _new_subject(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what the answer for a subject outside the pool depends on."""
    margin = study.config.new_subjects.margin_fraction
    return _answer(study, wildcards) | {
        "train_flow": speeds.train_flow(study, wildcards),
        "margin_fraction": margin,
    }


def _new_subject_of_population(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what the answer of a population's network for a subject outside the study depends on."""
    training = populations.train(study, wildcards)
    population = populations.simulate(study, {**wildcards, "shard": "0"})["population"]
    return _answer(study, wildcards) | {"train_population": training, "population": population}


def _answer(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what the chain of stages for a subject outside the study depends on, a part a stage."""
    own = replace(study, context_rows=study.new_rows)
    parts = {name: _SLICES[name](own, wildcards) for name in _OF_A_NEW_SUBJECT}
    config, name = study.config, study.config.base_of(named(study, wildcards, "experiment"))
    sizes = config.speed_experiments[name].misspecification.synthetic
    prior = config.experiments[name].prior
    draws = {"context": context_of(own, wildcards), "draws": [0, config.experiments[name].predictive.draws]}
    parts["ingest"]["recording"]["phases"] = config.new_subjects.phases or config.recording.phases
    parts["exact_subject_figures"]["cohort_title"] = config.new_subjects.cohort_title
    return parts | {
        "simulate": draws | {"prior": config.priors[prior].to_plain()} | common(config, "forward_model"),
        "reference_recordings": sizes.reference_recordings,
        "refinement": config.new_subjects.refinement.to_plain(),
        "noise_level": config.new_subjects.noise_level,
    }


def _nothing(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return {}


def _experiments_figure(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return figure(study, wildcards) | {"main_experiment": study.config.main_experiment}


def _workflow_figure(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    experiment = study.config.experiments[named(study, wildcards, "experiment")]
    return _figure_with_prior(study, wildcards) | {"estimator": experiment.estimator.model}


def _paper_comparison(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    config, parts = (
        study.config,
        ("prior", "observation_model", "estimator", "support", "predictive", "recovery"),
    )
    return {
        "cmaes": config.cmaes.search.to_plain(),
        "cohort_title": config.cohort_title,
        "experiment": of_experiment(study, wildcards, *parts),
        "main_experiment": named(study, wildcards, "experiment"),
        "recording": config.recording.to_plain(),
    }


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
    for key in ("resources", "results", "new_subjects"):
        del printed[key]
    return {
        "cohort_title": config.cohort_title,
        "configuration": printed,
        "experiments": shown,
        "main_experiment": config.main_experiment,
        "populations": populations,
    }


_OF_A_NEW_SUBJECT: Final = (
    "ingest",
    "passive",
    "cmaes",
    "exact_posterior",
    "verdict",
    "predictive_speeds",
    "exact_subject_figures",
)
_SLICES: Final[Mapping[str, Slice]] = {
    "ingest": _ingest,
    "ingest_batch": _ingest_batch,
    "noise": _noise,
    "passive": _passive,
    "simulate": _simulate,
    "pool": _pool,
    "train": _train,
    "posterior": _posterior,
    "predictive": _predictive,
    "recovery": _recovery,
    "recovery_acquisition": _recovery_acquisition,
    "epochs": _epochs,
    "epochs_figure": _epochs_figure,
    "acquisition_seeds": _acquisition_seeds,
    "speed_pool": speeds.speed_pool,
    "train_flow": speeds.train_flow,
    "exact_posterior": speeds.exact_posterior,
    "discrepancy": speeds.discrepancy,
    "noise_figure": figure,
    "sensitivity_run": speeds.sensitivity_run,
    "sensitivity": speeds.sensitivity,
    "predictive_speeds": speeds.predictive_speeds,
    "misspecification": speeds.misspecification,
    "misspecification_table": speeds.misspecification_table,
    "misspecification_figure": _misspecification_figure,
    "verdict": speeds.verdict,
    "new_subject": _new_subject,
    "new_subject_of_population": _new_subject_of_population,
    "identifiability": speeds.identifiability,
    "identifiability_figures": _identifiability_figures,
    "calibration_recordings": speeds.calibration_recordings,
    "calibration_local": speeds.calibration_local,
    "calibration": speeds.calibration,
    "calibration_figure": _calibration_figure,
    "population_simulate": populations.simulate,
    "train_population": populations.train,
    "population_calibration": populations.calibration,
    "population_scores": populations.scores,
    "population_null": populations.null,
    "population_answers": populations.answers,
    "population_cohort": populations.cohort,
    "strata_figure": populations.strata_figure,
    "population_agreement": populations.agreement,
    "cmaes": _cmaes,
    "subject_figures": _figure_with_prior,
    "exact_subject_figures": _exact_figures,
    "exact_figures": _exact_figures,
    "cohort_figures": _figure_with_prior,
    "training_figure": populations.training_figure,
    "tables": figure,
    "truth": _nothing,
    "workflow_figure": _workflow_figure,
    "experiments_figure": _experiments_figure,
    "paper_comparison": _paper_comparison,
    "report": _report,
}
STAGES: Final = tuple(_SLICES)
POPULATION_STAGES: Final = (
    "population_simulate",
    "train_population",
    "population_calibration",
    "population_scores",
    "population_null",
    "population_answers",
    "population_cohort",
    "strata_figure",
    "population_agreement",
    "new_subject_of_population",
)
"""The stages of experiments over a population."""
SPEED_STAGES: Final = (
    "speed_pool",
    "train_flow",
    "identifiability",
    "identifiability_figures",
    "exact_posterior",
    "predictive_speeds",
    "exact_subject_figures",
    "exact_figures",
    "misspecification",
    "misspecification_table",
    "misspecification_figure",
    "calibration_recordings",
    "calibration_local",
    "calibration",
    "calibration_figure",
    "verdict",
    "new_subject",
)
"""The stages of experiments of kind `speeds`; those that name an experiment and are not here: `features`."""
