"""A study of six synthetic subjects for the tests of the comparison with the paper and its figures."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
import pandas as pd
from evaluation_cases import INTERVAL, PRIOR, TITLE, check, cmaes_settings, fit, posterior_theta, verdict
from study_copy import ROOT

from swesbi.checks.cmaes import CmaesFit
from swesbi.config.read import read_merged
from swesbi.context import Context
from swesbi.measurement.settings import SUMMARY_NAMES
from swesbi.parameters import THETA_NAMES
from swesbi.posterior.settings import PosteriorSettings
from swesbi.posterior.truncated import summarise_posterior
from swesbi.recording.observation import Observation
from swesbi.recording.samples import REASONS
from swesbi.recording.speed import NoiseComponents
from swesbi.report.paper.study import fits_of_study, pool_sizes, recordings_of_study, settings_of_study
from swesbi.report.paper.values import Findings
from swesbi.report.study_tables import Case, features_table, posterior_table, ppc_table

CONFIG = read_merged(ROOT / "config.yaml")
SUBJECTS = "ABCDEF"
EXCLUDED = "EF"


def observation(subject: str) -> Observation:
    speed = np.linspace(1.0, 4.0, 20)
    stiffness = 3.0 * speed**2
    return Observation(
        context=Context(subject, "F", 27.0, 1.68, 64.0, 84.0, 31.0, 0.74),
        phase=np.arange(20) / 20.0,
        phase_index=np.arange(20),
        cell=np.arange(20),
        measured=np.arange(20) != 7,
        speed_m_s=speed,
        speed_se_m_s=0.03 * speed,
        stiffness_kpa=stiffness,
        stiffness_se_kpa=0.06 * stiffness,
        samples_accepted=np.full(20, 36),
        samples_by_repeat=np.full((20, 3), 12),
        samples_rejected=np.zeros((len(REASONS), 20), dtype=np.int64),
        noise=NoiseComponents(0.04, 0.08),
    )


@cache
def fitted(subject: str) -> CmaesFit:
    return fit(subject, cmaes_settings(generations=15))


@cache
def case(experiment: str, subject: str, supported: bool) -> Case:
    settings = PosteriorSettings(draws=1000, unfiltered_draws=200, interval=INTERVAL)
    draws, condition = posterior_theta(subject, 2000 if supported else 0), np.array([0.5, 1.2])
    posterior = summarise_posterior(draws, condition, ("maximum_kpa", "hr_bpm"), PRIOR, settings)
    judged = (check(subject, supported), posterior, verdict(subject, supported))
    return Case(experiment, subject, *judged, fitted(subject))


def cases(
    *experiments: str, subjects: Sequence[str] = SUBJECTS, excluded: Sequence[str] = EXCLUDED
) -> list[Case]:
    return [case(of, subject, subject not in excluded) for of in experiments for subject in subjects]


def recovery(*coverage: float) -> pd.DataFrame:
    rows = [
        (name, 0.9, value, value - 0.03, value + 0.03, 400)
        for name, value in zip(THETA_NAMES, coverage, strict=True)
    ]
    return pd.DataFrame(rows, columns=["parameter", "nominal", "coverage", "ci_low", "ci_high", "n"])


def study(*experiments: str, subjects: str = SUBJECTS, excluded: str = EXCLUDED) -> Findings:
    named = experiments or ("paper", "scalar_only", "wide_prior")
    all_cases = cases(*named, subjects=subjects, excluded=excluded)
    main = [case for case in all_cases if case.experiment == named[0]]
    epochs = np.arange(1, 31)
    training = pd.DataFrame({"epoch": epochs, "validation_loss": (epochs - 20.0) ** 2})
    experiment = CONFIG["experiments"]["paper"] | {"prior": CONFIG["priors"]["paper"]}
    search, recording = CONFIG["cmaes"]["search"], CONFIG["recording"]
    plain = {"experiment": experiment, "cmaes": search, "recording": recording}
    return Findings(
        cohort_title=TITLE,
        main=named[0],
        ppc=ppc_table(all_cases),
        posterior=posterior_table(all_cases),
        features=features_table(all_cases),
        verdicts={case.subject: case.verdict for case in main},
        recoveries={name: recovery(0.92, 0.90, 0.27) for name in named},
        design={
            **settings_of_study(plain, training),
            "protocol": {"push_frequency_mhz": 4.0, "push_duration_us": 300.0, "push_f_number": 1.0},
            "pool": pool_sizes(len(subjects), SUMMARY_NAMES, 120_000, (1000,) * len(subjects), TITLE),
            "recordings": recordings_of_study(
                [observation(subject) for subject in subjects], recording["density_kg_m3"]
            ),
            "fits": fits_of_study({case.subject: case.fit for case in main}, search),
        },
    )
