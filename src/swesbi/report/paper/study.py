"""What the paper prints, beside a study: every number of it, and every statement on its results.

What a study was made with stands here as the paper's numbers ask for it, by dotted paths.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from swesbi.artefacts.csv import PlainTable
from swesbi.artefacts.typed import ByExperiment, BySubject
from swesbi.checks.cmaes import CmaesFit
from swesbi.checks.settings import CmaesSettings, PredictiveSettings, RecoverySettings
from swesbi.context import Context
from swesbi.measurement.settings import SCALAR_NAMES
from swesbi.networks.paper.pool import Pool
from swesbi.networks.settings import EstimatorSettings, ObservationModelSettings
from swesbi.networks.training import TrainingTable
from swesbi.parameters import THETA_NAMES
from swesbi.prior import PriorSettings
from swesbi.recording.cohort.recording_file import read_recording_file
from swesbi.recording.observation import Observation
from swesbi.recording.settings import RecordingSettings
from swesbi.report.paper.comparison import (
    ComparisonTable,
    StatementsTable,
    comparison_table,
    score_in_words,
    statements_table,
)
from swesbi.report.paper.values import Findings, StudyValue, read_paper, shown
from swesbi.verdict.settings import SupportSettings
from swesbi.verdict.verdict import Verdict

LOGGER = logging.getLogger("swesbi")
Design = Mapping[str, Any]
"""Numbers by dotted paths, nested; a value of the study where more is said than the number."""


class PaperComparison(NamedTuple):
    """One row for every number that the paper prints, and one for every statement on its results."""

    comparison_csv: ComparisonTable
    statements_csv: StatementsTable


def beside_the_paper(
    protocol: Path,
    ppc: PlainTable,
    posterior: PlainTable,
    features: PlainTable,
    recoveries: ByExperiment[PlainTable],
    training: TrainingTable,
    pool: Pool,
    verdicts: BySubject[Verdict],
    observations: tuple[Observation, ...],
    cmaes: BySubject[CmaesFit],
    *,
    cohort_title: str,
    main_experiment: str,
    prior: PriorSettings,
    observation_model: ObservationModelSettings,
    estimator: EstimatorSettings,
    support: SupportSettings,
    predictive: PredictiveSettings,
    recovery: RecoverySettings,
    search: CmaesSettings,
    recording: RecordingSettings,
) -> PaperComparison:
    """Compare the paper with a study.

    ``protocol`` is the cohort's ``recording.yaml``; tables and recoveries are of all experiments, and what
    follows them, settings too, of the main one.
    """
    experiment = {
        "prior": prior, "observation_model": observation_model, "estimator": estimator, "support": support,
        "predictive": predictive, "recovery": recovery,
    }  # fmt: skip
    settings = {
        "experiment": {name: each.to_plain() for name, each in experiment.items()},
        "cmaes": search.to_plain(),
        "recording": recording.to_plain(),
    }
    study = Findings(
        cohort_title=cohort_title,
        main=main_experiment,
        ppc=ppc,
        posterior=posterior,
        features=features,
        verdicts=dict(verdicts),
        recoveries=dict(recoveries),
        design={
            **settings_of_study(settings, training),
            "protocol": read_recording_file(protocol.parent).protocol.to_plain(),
            "pool": pool_of_study(pool, cohort_title),
            "recordings": recordings_of_study(observations, recording.density_kg_m3),
            "fits": fits_of_study(dict(cmaes), settings["cmaes"]),
        },
    )
    numbers = read_paper()
    table, statements = comparison_table(numbers, study), statements_table(numbers, study)
    LOGGER.info(score_in_words(statements))
    return PaperComparison(table, statements)


def settings_of_study(settings: Mapping[str, Any], training: pd.DataFrame) -> Design:
    """Return the settings, and of the epochs how many were run; ``training`` has one row an epoch.

    Settings are plain: ``experiment`` (the main one, its prior as such), ``cmaes``, ``recording``.
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
