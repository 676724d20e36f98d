"""What a study was made with, as the paper's numbers ask for it, by dotted paths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any

import numpy as np
import pandas as pd

from swesbi.checks.cmaes import CmaesFit
from swesbi.context import Context
from swesbi.measurement.settings import SCALAR_NAMES
from swesbi.networks.paper.pool import Pool
from swesbi.parameters import THETA_NAMES
from swesbi.recording.observation import Observation
from swesbi.report.paper.study_values import StudyValue, shown

Design = Mapping[str, Any]
"""Numbers by dotted paths, nested; a value of the study where more is said than the number."""


def settings_of_study(settings: Mapping[str, Any], training: pd.DataFrame) -> Design:
    """Return the settings, and of the epochs how many were run.

    Args:
        settings: Plain settings: ``experiment`` (the main one, its prior as such), ``cmaes``, ``recording``.
        training: Losses of the main experiment, one row an epoch.
    """
    noise = settings["experiment"]["observation_model"]["feature_noise_sd"]
    best = int(training["epoch"].to_numpy()[int(np.argmin(training["validation_loss"].to_numpy()))])
    epochs = settings["experiment"]["estimator"]["max_num_epochs"]
    return {
        **settings,
        "epochs": StudyValue(f"{epochs} ({len(training)} run, weights of epoch {best})", float(epochs)),
        "noisy_features": sum(sd > 0.0 for sd in noise.values()),
        "inferred_parameters": len(THETA_NAMES),
        "sbi": StudyValue(version("sbi")),
    }


def pool_of_study(pool: Pool, cohort_title: str) -> Design:
    """Return the sizes of the main experiment's pool; of simulations of a subject, the fewest."""
    drawn = np.unique(np.stack([pool.subject_index, pool.draw_index]), axis=1)
    counts = np.bincount(drawn[0], minlength=len(pool.subjects))
    return pool_sizes(
        len(pool.subjects), pool.components.features, len(pool.z), counts.tolist(), cohort_title
    )


def pool_sizes(
    subjects: int, features: Sequence[str], rows: int, simulations: Sequence[int], cohort_title: str
) -> Design:
    """Return the sizes of a pool from its subjects, features, rows, and simulations of each subject."""
    scalars = sum(name in SCALAR_NAMES for name in features)
    return {
        "subjects": StudyValue(f"{subjects} {cohort_title}", subjects),
        "features": {"all": len(features), "scalar": scalars, "trajectory": len(features) - scalars},
        "rows": StudyValue(f"{rows:,}", rows),
        "simulations": {"of_a_subject": int(min(simulations)), "all": int(sum(simulations))},
    }


def recordings_of_study(observations: Sequence[Observation], density_kg_m3: float) -> Design:
    """Return how subjects were recorded: phases, E / (rho c_s^2), and what maps contexts (paper, Eq. 2)."""
    phases = sorted({len(observation.phase) for observation in observations})
    gaps = sum(not observation.measured.all() for observation in observations)
    text = " or ".join(map(str, phases)) + (f" (incomplete recordings: {gaps})" if gaps else "")
    ratios = [1e3 * each.stiffness_kpa / (density_kg_m3 * each.speed_m_s**2) for each in observations]
    factors = pd.DataFrame([_factors(observation.context) for observation in observations]).mean()
    return {
        "phases": StudyValue(text, float(phases[-1])),
        "modulus_factor": float(np.nanmedian(np.concatenate(ratios))),
        "factor": {str(name): StudyValue(f"{value:.4g}", value) for name, value in factors.items()},
    }


def _factors(context: Context) -> dict[str, float]:
    return {
        "period": context.period_s * context.hr_bpm,
        "thickness": context.thickness_m / context.ivsd_cm,
        "radius": 4.0 * np.pi * context.radius_m**3 / context.lvedv_ml,
    }


def fits_of_study(fits: Mapping[str, CmaesFit], search: Mapping[str, Any]) -> Design:
    """Return the seeds of the CMA-ES fits, and the evaluations permitted, with the most that are used."""
    seeds = sorted({int(seed) for fit in fits.values() for seed in fit.seed})
    allowed = len(search["seeds"]) * search["population_size"] * search["generations"]
    used = max(int(fit.evaluations[:, -1].sum()) for fit in fits.values())
    return {
        "runs": len(seeds),
        "first_seed": seeds[0],
        "last_seed": seeds[-1],
        "evaluations": StudyValue(f"{shown(allowed, 0)} (at most {used} used)", allowed),
    }
