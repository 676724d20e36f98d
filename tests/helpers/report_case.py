"""An experiment of plain numbers, for the tests of the page."""

from __future__ import annotations

import math

import pandas as pd

from swesbi.parameters import THETA_NAMES, THETA_UNITS
from swesbi.report.results import Experiment
from swesbi.verdict.verdict import Verdict

SETTINGS = {
    "posterior": {"interval": 0.9},
    "predictive": {"interval": 0.9},
    "support": {"max_abs_z": 3.0, "min_in_prior_draws": 1000, "candidate_draws": 500000},
    "summary": {"use_trajectory": True},
}
BEFORE = {
    "rmse_prior_kpa": 10.0,
    "rmse_cmaes_kpa": 4.0,
    "coverage_prior_band_grid": 0.7,
    "coverage_prior_envelope_grid": 0.75,
}
SCORES = {
    "rmse_kpa": 2.0,
    "rmse_reduction_percent": 80.0,
    "nrmse": 0.1,
    "r2": 0.99,
    "post_peak_rmse_kpa": 3.0,
    "coverage_grid": 0.6,
    "coverage_phases": 0.5,
    "coverage_noiseless_grid": 0.6,
    "coverage_noiseless_phases": 0.5,
    "coverage_observed_grid": 0.9,
    "coverage_observed_phases": 0.8,
}


def make_experiment(name: str, supported: dict[str, bool], use_trajectory: bool = True) -> Experiment:
    """Return an experiment with plain numbers; scores of subjects not prior-supported are missing."""
    scores, posterior, features = [], [], []
    for subject, known in supported.items():
        one = 1.0 if known else math.nan
        of = {"experiment": name, "subject": subject, "may_be_read": known}
        scores.append(of | BEFORE | {column: one * value for column, value in SCORES.items()})
        interval = {"median": one, "pi_low": one, "pi_high": one, "inside": known}
        features.append(of | {"feature": "maximum_kpa", "observed": 40.0, "prior_median": 30.0} | interval)
        correlations = {f"correlation_{parameter}": one * -0.5 for parameter in THETA_NAMES}
        answer = {"median": one * 5, "ci_low": one * 4, "ci_high": one * 6, "measured": math.nan}
        for parameter, unit in zip(THETA_NAMES, THETA_UNITS, strict=True):
            fitted = {"parameter": parameter, "unit": unit, "unfiltered_median": 7.0, "cmaes": 8.0}
            posterior.append(of | answer | correlations | fitted)
        derived = {"parameter": "ejection_fraction", "unit": "1", "measured": 0.6}
        posterior.append(of | {"median": one, "ci_low": one, "ci_high": one} | derived)
    recovery = pd.DataFrame(
        [[p, level, 0.25, 0.2, 0.3, 400, -1.0, 0.9] for p in THETA_NAMES for level in (0.5, 0.9)],
        columns=["parameter", "nominal", "coverage", "ci_low", "ci_high", "n", "bias", "contraction"],
    )
    return Experiment(
        name=name,
        settings=SETTINGS | {"summary": {"use_trajectory": use_trajectory}},
        verdicts={subject: make_verdict(known) for subject, known in supported.items()},
        scores=pd.DataFrame(scores),
        features=pd.DataFrame(features),
        posterior=pd.DataFrame(posterior),
        recovery=recovery,
        recovery_acquisition=recovery.assign(coverage=0.125),
        training=pd.DataFrame(
            {"epoch": [1, 2, 3], "training_loss": [3, 2, 1], "validation_loss": [3.0, 1.0, 2.0]}
        ),
    )


def make_verdict(supported: bool) -> Verdict:
    """Return a verdict."""
    status, reasons = "prior-supported", ()
    if not supported:
        status, reasons = "not prior-supported", ("none of the draws",)
    medians = dict.fromkeys(THETA_NAMES, 7.0)
    return Verdict(2.5, "auc_kpa", 1234, 500000, medians, status, "the verdict", reasons)
