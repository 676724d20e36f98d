"""This study's values of what the paper fixes: protocol, context mapping, sizes, settings."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

import numpy as np

from swesbi.context import Context
from swesbi.measurement.settings import SCALAR_NAMES
from swesbi.parameters import THETA_NAMES
from swesbi.report.paper.study_values import StudyResults, StudyValue, absent, number
from swesbi.report.paper.values import PaperNumber


def configured(study: StudyResults, asked: PaperNumber) -> StudyValue:
    """Return a number of the configuration, by its dotted path; ``factor`` changes its unit."""
    value: Any = study.settings
    for key in asked.option("path").split("."):
        if not isinstance(value, Mapping) or key not in value:
            return absent(f"the configuration has no {asked.option('path')}")
        value = value[key]
    return number(float(value) * float(asked.row.of.get("factor", 1.0)), asked)


def protocol(study: StudyResults, asked: PaperNumber) -> StudyValue:
    """Return a number of the cohort's recording protocol."""
    value = study.protocol.get(asked.option("key"))
    if value is None:
        return absent("the cohort's recording.yaml does not say")
    return number(float(value), asked)


def recorded_phases(study: StudyResults, asked: PaperNumber) -> StudyValue:
    """Return the phases of a recording, and of how many recordings some are missing."""
    phases = sorted({len(observation.phase) for observation in study.observations})
    gaps = sum(not observation.measured.all() for observation in study.observations)
    text = " or ".join(map(str, phases)) + (f" (incomplete recordings: {gaps})" if gaps else "")
    return StudyValue(text, float(phases[-1]))


def modulus_factor(study: StudyResults, asked: PaperNumber) -> StudyValue:
    """Return E / (rho c_s^2) of the recordings."""
    density = float(study.settings["recording"]["density_kg_m3"])
    ratios = [
        1e3 * observation.stiffness_kpa / (density * observation.speed_m_s**2)
        for observation in study.observations
    ]
    return number(float(np.nanmedian(np.concatenate(ratios))), asked)


def context_factor(study: StudyResults, asked: PaperNumber) -> StudyValue:
    """Return the factor that maps a subject's context to the simulator (paper, Eq. 2)."""
    name = asked.option("name")
    value = float(np.mean([_context_factor(observation.context, name) for observation in study.observations]))
    return StudyValue(f"{value:.4g}", value)


def _context_factor(context: Context, name: str) -> float:
    factors = {
        "period": context.period_s * context.hr_bpm,
        "thickness": context.thickness_m / context.ivsd_cm,
        "radius": 4.0 * np.pi * context.radius_m**3 / context.lvedv_ml,
    }
    return float(factors[name])


def inferred_parameters(study: StudyResults, asked: PaperNumber) -> StudyValue:
    """Return the number of inferred parameters."""
    return number(len(THETA_NAMES), asked)


def pool_subjects(study: StudyResults, asked: PaperNumber) -> StudyValue:
    """Return how many subjects were pooled."""
    return number(len(study.pool.subjects), asked, f" {study.cohort_title}")


def pool_features(study: StudyResults, asked: PaperNumber) -> StudyValue:
    """Return how many features the pool has: all, scalar ones, or values of the trajectory."""
    scalar = sum(name in SCALAR_NAMES for name in study.pool.features)
    counts = {"all": len(study.pool.features), "scalar": scalar}
    return number(counts.get(asked.option("kind"), len(study.pool.features) - scalar), asked)


def noisy_features(study: StudyResults, asked: PaperNumber) -> StudyValue:
    """Return how many features the observation model perturbs."""
    noise = study.settings["experiment"]["observation_model"]["feature_noise_sd"]
    return number(sum(sd > 0.0 for sd in noise.values()), asked)


def pool_simulations(study: StudyResults, asked: PaperNumber) -> StudyValue:
    """Return the successful simulations in the pool, of one subject or of all."""
    counts = study.pool.simulations
    return number(min(counts) if asked.row.of["per_subject"] else sum(counts), asked)


def pool_rows(study: StudyResults, asked: PaperNumber) -> StudyValue:
    """Return the size of the training pool."""
    return StudyValue(f"{study.pool.rows:,}", study.pool.rows)


def sbi_version(study: StudyResults, asked: PaperNumber) -> StudyValue:
    """Return the version of sbi that is installed."""
    return StudyValue(version("sbi"))


def epochs(study: StudyResults, asked: PaperNumber) -> StudyValue:
    """Return the permitted epochs, with those run and the one whose weights are kept."""
    value = float(study.settings["experiment"]["estimator"]["max_num_epochs"])
    run, losses = len(study.training), study.training["validation_loss"]
    best = int(study.training["epoch"].to_numpy()[int(np.argmin(losses.to_numpy()))])
    return number(value, asked, f" ({run} run, weights of epoch {best})")


def cmaes_runs(study: StudyResults, asked: PaperNumber) -> StudyValue:
    """Return the number of seeded runs of each fit, or the first or the last seed."""
    seeds = sorted({int(seed) for fit in study.fits.values() for seed in fit.seed})
    values = {"runs": len(seeds), "first_seed": seeds[0], "last_seed": seeds[-1]}
    return number(values[asked.option("what")], asked)


def cmaes_evaluations(study: StudyResults, asked: PaperNumber) -> StudyValue:
    """Return the permitted simulator evaluations of one subject, with the most that a subject used."""
    search = study.settings["cmaes"]
    allowed = len(search["seeds"]) * search["population_size"] * search["generations"]
    used = max(int(fit.evaluations[:, -1].sum()) for fit in study.fits.values())
    return number(allowed, asked, f" (at most {used} used)")
