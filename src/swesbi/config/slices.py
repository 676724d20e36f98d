"""Which part of the configuration each stage depends on: what its rule is rerun for, and nothing else.

Every slice is plain data with the fields of the stage's own settings class.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from swesbi.config.errors import ConfigError
from swesbi.config.models import Config
from swesbi.config.study import Study
from swesbi.simulations.shards import shard_draws

Wildcards = Mapping[str, str]
Slice = Callable[[Study, Wildcards], dict[str, Any]]


def stage_settings(study: Study, stage: str, **wildcards: str) -> dict[str, Any]:
    """Return the plain, key-sorted settings of a stage under these wildcards (subject, experiment, ...).

    Raises:
        ConfigError: A wildcard is missing or names nothing that the study has.
        KeyError: There is no such stage.
    """
    return dict(sorted(_SLICES[stage](study, wildcards).items()))


def _ingest(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return {"context": _context(study, wildcards)} | _common(study.config, "recording", "measurement")


def _noise(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return _common(study.config, "recording", "noise")


def _passive(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    prior = study.config.priors[study.config.passive_reference_prior]
    return {"prior": prior.to_plain()} | _common(study.config, "forward_model", "passive", "measurement")


def _simulate(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    config, prior = study.config, _named(study, wildcards, "prior")
    draws = config.simulations_per_subject(prior)
    shard = shard_draws(int(_wildcard(wildcards, "shard")), config.resources.shards_per_subject, draws)
    return {
        "context": _context(study, wildcards),
        "draws": [shard.start, shard.stop],
        "prior": config.priors[prior].to_plain(),
    } | _common(config, "forward_model")


def _pool(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return _common(study.config, "measurement") | _of_experiment(
        study, wildcards, "summary", "observation_model", "simulations_per_subject"
    )


def _train(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    epoch_study = _of_experiment(study, wildcards, "epoch_study")["epoch_study"]
    own = _of_experiment(study, wildcards, "estimator", "prior")
    return own | {"checkpoint_epochs": epoch_study["checkpoint_epochs"]}


def _posterior(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return _of_experiment(study, wildcards, "support", "posterior", "prior")


def _predictive(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    experiment = _of_experiment(study, wildcards, "summary", "observation_model", "predictive")
    return experiment | _common(study.config, "forward_model", "measurement")


def _recovery(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    experiment = _of_experiment(study, wildcards, "summary", "observation_model", "recovery", "prior")
    return experiment | _common(study.config, "forward_model", "measurement")


def _recovery_acquisition(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    common = _common(study.config, "acquisition", "forward_model", "measurement", "passive", "recording")
    reference = study.config.priors[study.config.passive_reference_prior].to_plain()
    own = _of_experiment(study, wildcards, "summary", "recovery", "prior")
    return common | own | {"passive_reference_prior": reference}


def _epochs(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    own = _of_experiment(study, wildcards, "support", "predictive", "epoch_study")
    draws = own.pop("epoch_study")["candidate_draws"]
    return _recovery(study, wildcards) | own | {"candidate_draws": draws}


def _epochs_figure(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    name = _named(study, wildcards, "experiment")
    interval = study.config.experiments[name].predictive.interval
    return _figure(study, wildcards) | {"experiment": name, "interval": interval}


def _acquisition_seeds(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    common = _common(study.config, "forward_model", "measurement", "passive", "recording")
    reference = study.config.priors[study.config.passive_reference_prior].to_plain()
    own = _of_experiment(study, wildcards, "summary", "support", "predictive", "prior")
    seeds = list(study.config.acquisition_seeds.seeds)
    return common | own | {"passive_reference_prior": reference, "seeds": seeds}


def _speed_model(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return the settings of the model of a recording, shared by the stages of experiments on speeds."""
    config = study.config
    own = _of_experiment(study, wildcards, "prior", "passive_scale_kpa", "observation_model")
    return {
        "prior": {"theta": own["prior"], "passive_scale_kpa": own["passive_scale_kpa"]},
        "discrepancy": own["observation_model"]["discrepancy"],
        "passive": config.passive.to_plain(),
        "passive_reference_prior": config.priors[config.passive_reference_prior].to_plain(),
        "density_kg_m3": config.recording.density_kg_m3,
    } | _common(config, "forward_model", "measurement")


def _speed_pool(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return _of_experiment(study, wildcards, "simulations_per_subject") | _common(study.config, "measurement")


def _train_flow(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    own = _of_experiment(study, wildcards, "estimator", "summary")
    return own | {"model": _speed_model(study, wildcards)}


def _exact_posterior(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return _of_experiment(study, wildcards, "exact") | {"model": _speed_model(study, wildcards)}


def _discrepancy(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    section = study.config.discrepancy_study.to_plain()
    none = {"speed_fraction": 0.0, "timing_cycle": 0.0}  # what is chosen already must not matter
    model = _speed_model(study, {"experiment": section.pop("experiment")}) | {"discrepancy": none}
    return {"model": model, "study": section} | _common(study.config, "acquisition", "recording")


def _sensitivity_run(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    section, name = study.config.sensitivity, _named(study, wildcards, "variant")
    variant = section.variants[name]
    changed = study.with_changes(variant.changes, f"sensitivity.variants.{name}.changes")
    of_experiment = {"experiment": section.experiment}
    training = _train_flow(changed, of_experiment)
    if not variant.full_training:
        training["estimator"]["epochs"] = section.short_training_epochs
    return {
        "fix_passive_scale": variant.fix_passive_scale,
        "seed": changed.config.seed,
        "train": training,
    } | _of_experiment(changed, of_experiment, "exact", "simulations_per_subject")


def _sensitivity(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    section = study.config.sensitivity
    interval = _of_experiment(study, {"experiment": section.experiment}, "exact")["exact"]["interval"]
    labels = {name: variant.label for name, variant in section.variants.items()}
    return _figure(study, wildcards) | {"interval": interval, "labels": labels}


def _predictive_speeds(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    own = _of_experiment(study, wildcards, "summary", "predictive")
    return own | {"model": _speed_model(study, wildcards)}


def _misspecification(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    own = _of_experiment(study, wildcards, "misspecification")["misspecification"]
    parts = {"model": _speed_model(study, wildcards), "synthetic": own["synthetic"]}
    return parts | _common(study.config, "acquisition", "recording")


def _misspecification_table(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return {"rule": _of_experiment(study, wildcards, "misspecification")["misspecification"]["rule"]}


def _misspecification_figure(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    rule = _misspecification_table(study, wildcards)["rule"]
    return _figure(study, wildcards) | {"strained_level": rule["strained_level"]}


def _verdict(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    own = _of_experiment(study, wildcards, "misspecification", "summary")
    tests = own["misspecification"]
    return {
        "model": _speed_model(study, wildcards),
        "rule": tests["rule"],
        "strip_fraction": tests["synthetic"]["strip_fraction"],
        "summary": own["summary"],
    }


def _identifiability(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return _of_experiment(study, wildcards, "identifiability") | {"model": _speed_model(study, wildcards)}


def _identifiability_figures(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    _named(study, wildcards, "experiment")
    return _figure(study, wildcards)


def _calibration_recordings(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    own = _of_experiment(study, wildcards, "exact", "calibration")
    parts = {"recordings": own["calibration"]["recordings"], "exact": own["exact"]}
    parts["model"] = _speed_model(study, wildcards)
    return parts | _common(study.config, "acquisition", "recording")


def _calibration_local(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    own = _of_experiment(study, wildcards, "exact", "calibration")
    parts = {"local": own["calibration"]["local"], "exact": own["exact"]}
    return parts | {"model": _speed_model(study, wildcards)}


def _calibration(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    own = _of_experiment(study, wildcards, "prior", "calibration")
    return {"prior": own["prior"], "judgement": own["calibration"]["judgement"]}


def _calibration_figure(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    own = _of_experiment(study, wildcards, "exact", "calibration")
    shown = {"judgement": own["calibration"]["judgement"], "max_k_hat": own["exact"]["max_k_hat"]}
    return _figure(study, wildcards) | shown | {"experiment": _named(study, wildcards, "experiment")}


def _cmaes(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    config = study.config
    own = {"search": config.cmaes.search.to_plain(), "prior": config.priors[config.cmaes.prior].to_plain()}
    return own | _common(config, "forward_model", "measurement")


def _figure(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return {"cohort_title": study.config.cohort_title}


def _figure_with_prior(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return _figure(study, wildcards) | _of_experiment(study, wildcards, "prior")


def _exact_figure(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return _figure(study, wildcards) | {"prior": _speed_model(study, wildcards)["prior"]}


def _nothing(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return {}


def _experiments_figure(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return _figure(study, wildcards) | {"main_experiment": study.config.main_experiment}


def _workflow_figure(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    experiment = study.config.experiments[_named(study, wildcards, "experiment")]
    return _figure_with_prior(study, wildcards) | {"estimator": experiment.estimator.model}


def _paper_comparison(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    config, parts = (
        study.config,
        ("prior", "observation_model", "estimator", "support", "predictive", "recovery"),
    )
    return {
        "cmaes": config.cmaes.search.to_plain(),
        "cohort_title": config.cohort_title,
        "experiment": _of_experiment(study, wildcards, *parts),
        "main_experiment": _named(study, wildcards, "experiment"),
        "recording": config.recording.to_plain(),
    }


def _report(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    config = study.config
    shown = {
        name: config.experiments[name].to_plain()
        | {"prior": config.priors[config.experiments[name].prior].to_plain()}
        for name in config.experiments_run
    }
    # where results lie and how the work is split change no result, and so not the page either
    printed = config.to_plain()
    for key in ("resources", "results"):
        del printed[key]
    return {
        "cohort_title": config.cohort_title,
        "configuration": printed,
        "experiments": shown,
        "main_experiment": config.main_experiment,
    }


def _common(config: Config, *names: str) -> dict[str, Any]:
    """Return parts of the configuration that are the same for every experiment."""
    return {name: getattr(config, name).to_plain() for name in names}


def _of_experiment(study: Study, wildcards: Wildcards, *names: str) -> dict[str, Any]:
    """Return parts of one experiment's section; its prior as the prior itself, not its name."""
    config = study.config
    experiment = config.experiments[_named(study, wildcards, "experiment")]
    plain = experiment.to_plain() | {"prior": config.priors[experiment.prior].to_plain()}
    if missing := [name for name in names if name not in plain]:
        raise ConfigError(
            f"the experiment {wildcards['experiment']!r} is of kind {experiment.kind!r} and has no "
            f"{missing[0]}; this stage is for experiments of another kind"
        )
    return {name: plain[name] for name in names}


def _context(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    return study.context_rows[_named(study, wildcards, "subject")].to_plain()


def _named(study: Study, wildcards: Wildcards, kind: str) -> str:
    """Return a wildcard that must name a subject, an experiment or a prior of the study."""
    name = _wildcard(wildcards, kind)
    known = {
        "subject": study.context_rows,
        "experiment": study.config.experiments,
        "prior": study.config.priors,
        "variant": study.config.sensitivity.variants,
    }
    if name not in known[kind]:
        raise ConfigError(f"{kind} = {name!r}: unknown; the study has {', '.join(known[kind])}")
    return name


def _wildcard(wildcards: Wildcards, kind: str) -> str:
    if kind not in wildcards:
        raise ConfigError(f"say which {kind}: --{kind} NAME")
    return wildcards[kind]


_SLICES: Final[Mapping[str, Slice]] = {
    "ingest": _ingest,
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
    "speed_pool": _speed_pool,
    "train_flow": _train_flow,
    "exact_posterior": _exact_posterior,
    "discrepancy": _discrepancy,
    "noise_figure": _figure,
    "sensitivity_run": _sensitivity_run,
    "sensitivity": _sensitivity,
    "predictive_speeds": _predictive_speeds,
    "misspecification": _misspecification,
    "misspecification_table": _misspecification_table,
    "misspecification_figure": _misspecification_figure,
    "verdict": _verdict,
    "identifiability": _identifiability,
    "identifiability_figures": _identifiability_figures,
    "calibration_recordings": _calibration_recordings,
    "calibration_local": _calibration_local,
    "calibration": _calibration,
    "calibration_figure": _calibration_figure,
    "cmaes": _cmaes,
    "ppc_figure": _figure,
    "posterior_figure": _figure_with_prior,
    "exact_figure": _exact_figure,
    "exact_figures": _exact_figure,
    "cohort_figures": _figure_with_prior,
    "training_figure": _figure,
    "tables": _figure,
    "truth": _nothing,
    "workflow_figure": _workflow_figure,
    "experiments_figure": _experiments_figure,
    "paper_comparison": _paper_comparison,
    "report": _report,
}
STAGES: Final = tuple(_SLICES)
SPEED_STAGES: Final = (
    "speed_pool",
    "train_flow",
    "identifiability",
    "identifiability_figures",
    "exact_posterior",
    "predictive_speeds",
    "exact_figure",
    "exact_figures",
    "misspecification",
    "misspecification_table",
    "misspecification_figure",
    "calibration_recordings",
    "calibration_local",
    "calibration",
    "calibration_figure",
    "verdict",
)
"""The stages of experiments of kind `speeds`; those that name an experiment and are not here: `features`."""
