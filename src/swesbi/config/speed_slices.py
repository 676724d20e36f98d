"""Slices of the stages of experiments on speeds, and of the studies around them."""

from __future__ import annotations

from typing import Any

from swesbi.config.parts import Wildcards, common, figure, named, of_experiment
from swesbi.config.study import Study


def speed_model(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return the settings of the model of a recording, shared by the stages of experiments on speeds."""
    config = study.config
    own = of_experiment(study, wildcards, "prior", "passive_scale_kpa", "observation_model")
    return {
        "prior": {"theta": own["prior"], "passive_scale_kpa": own["passive_scale_kpa"]},
        "discrepancy": own["observation_model"]["discrepancy"],
        "passive": config.passive.to_plain(),
        "passive_reference_prior": config.priors[config.passive_reference_prior].to_plain(),
        "density_kg_m3": config.recording.density_kg_m3,
    } | common(config, "forward_model", "measurement")


def speed_pool(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what the training set depends on."""
    return of_experiment(study, wildcards, "simulations_per_subject") | common(study.config, "measurement")


def train_flow(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what the network depends on."""
    own = of_experiment(study, wildcards, "estimator", "summary")
    return own | {"model": speed_model(study, wildcards)}


def exact_posterior(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what an exact posterior depends on."""
    return of_experiment(study, wildcards, "exact") | {"model": speed_model(study, wildcards)}


def discrepancy(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what the choice of the discrepancy depends on."""
    section = study.config.discrepancy_study.to_plain()
    none = {"speed_fraction": 0.0, "timing_cycle": 0.0}  # what is chosen already must not matter
    model = speed_model(study, {"experiment": section.pop("experiment")}) | {"discrepancy": none}
    return {"model": model, "study": section} | common(study.config, "acquisition", "recording")


def sensitivity_run(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what one variant of an experiment depends on."""
    section, name = study.config.sensitivity, named(study, wildcards, "variant")
    variant = section.variants[name]
    changed = study.with_changes(variant.changes, f"sensitivity.variants.{name}.changes")
    chosen = {"experiment": section.experiment}
    training = train_flow(changed, chosen)
    if not variant.full_training:
        training["estimator"]["epochs"] = section.short_training_epochs
    return {
        "fix_passive_scale": variant.fix_passive_scale,
        "seed": changed.config.seed,
        "train": training,
    } | of_experiment(changed, chosen, "exact", "simulations_per_subject")


def sensitivity(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what the table and figure of all variants depend on."""
    section = study.config.sensitivity
    interval = of_experiment(study, {"experiment": section.experiment}, "exact")["exact"]["interval"]
    labels = {name: variant.label for name, variant in section.variants.items()}
    return figure(study, wildcards) | {"interval": interval, "labels": labels}


def predictive_speeds(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what predictive checks depend on."""
    own = of_experiment(study, wildcards, "summary", "predictive")
    return own | {"model": speed_model(study, wildcards)}


def misspecification(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what the null distributions of the tests depend on."""
    own = of_experiment(study, wildcards, "misspecification", "summary")
    synthetic = own.pop("misspecification")["synthetic"]
    parts = own | {"model": speed_model(study, wildcards), "synthetic": synthetic}
    return parts | common(study.config, "acquisition", "recording")


def misspecification_table(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what false alarms and power depend on."""
    return {"rule": of_experiment(study, wildcards, "misspecification")["misspecification"]["rule"]}


def verdict(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what a verdict depends on."""
    own = of_experiment(study, wildcards, "misspecification", "summary")
    tests = own["misspecification"]
    return {
        "model": speed_model(study, wildcards),
        "rule": tests["rule"],
        "strip_fraction": tests["synthetic"]["strip_fraction"],
        "summary": own["summary"],
    }


def identifiability(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what the identifiability stage depends on."""
    return of_experiment(study, wildcards, "identifiability") | {"model": speed_model(study, wildcards)}


def calibration_recordings(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what recordings of known parameters depend on."""
    own = of_experiment(study, wildcards, "exact", "calibration")
    parts = {"recordings": own["calibration"]["recordings"], "exact": own["exact"]}
    parts["model"] = speed_model(study, wildcards)
    return parts | common(study.config, "acquisition", "recording")


def calibration_local(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what calibration at a subject's own data depends on."""
    own = of_experiment(study, wildcards, "exact", "calibration")
    parts = {"local": own["calibration"]["local"], "exact": own["exact"]}
    return parts | {"model": speed_model(study, wildcards)}


def calibration(study: Study, wildcards: Wildcards) -> dict[str, Any]:
    """Return what the checks of calibration depend on."""
    own = of_experiment(study, wildcards, "prior", "calibration")
    return {"prior": own["prior"], "judgement": own["calibration"]["judgement"]}
