"""An experiment of plain numbers, for the tests of the page."""

from __future__ import annotations

import math

import pandas as pd

from swesbi.parameters import THETA, THETA_NAMES
from swesbi.report.results import Experiment
from swesbi.report.tables.subjects import SCORES
from swesbi.verdict.verdict import Verdict

SETTINGS = {
    "posterior": {"interval": 0.9},
    "predictive": {"interval": 0.9},
    "support": {"max_abs_z": 3.0, "min_in_prior_draws": 1000, "candidate_draws": 500000},
    "summary": {"use_trajectory": True},
}
BEFORE = ("rmse_prior_kpa", "rmse_cmaes_kpa", "coverage_prior_band_grid", "coverage_prior_envelope_grid")


def make_experiment(name: str, supported: dict[str, bool], use_trajectory: bool = True) -> Experiment:
    """Return an experiment with plain numbers; scores of subjects not prior-supported are missing."""
    scores, posterior, features = [], [], []
    for subject, known in supported.items():
        one = 1.0 if known else math.nan
        of = {"experiment": name, "subject": subject, "may_be_read": known}
        scores.append(of | {column: 2.0 * (1.0 if column in BEFORE else one) for column in SCORES})
        interval = {"median": one, "pi_low": one, "pi_high": one, "inside": known}
        features.append(of | {"feature": "maximum_kpa", "observed": 40.0, "prior_median": 30.0} | interval)
        answer = {f"correlation_{parameter}": one * -0.5 for parameter in THETA_NAMES}
        answer |= {"median": one * 5, "ci_low": one * 4, "ci_high": one * 6, "measured": math.nan}
        for parameter in THETA:
            fitted = {"unfiltered_median": 7.0, "cmaes": 8.0}
            posterior.append(of | answer | fitted | {"parameter": parameter.name, "unit": parameter.unit})
        derived = {"parameter": "ejection_fraction", "unit": "1", "measured": 0.6}
        posterior.append(of | {"median": one, "ci_low": one, "ci_high": one} | derived)
    recovery = pd.DataFrame(
        [[p, level, 0.25, 0.2, 0.3, 400, -1.0, 0.9] for p in THETA_NAMES for level in (0.5, 0.9)],
        columns=["parameter", "nominal", "coverage", "ci_low", "ci_high", "n", "bias", "contraction"],
    )
    losses = {"epoch": [1, 2, 3], "training_loss": [3, 2, 1], "validation_loss": [3.0, 1.0, 2.0]}
    return Experiment(
        name=name,
        settings=SETTINGS | {"summary": {"use_trajectory": use_trajectory}},
        verdicts={subject: make_verdict(known) for subject, known in supported.items()},
        scores=pd.DataFrame(scores),
        features=pd.DataFrame(features),
        posterior=pd.DataFrame(posterior),
        recovery=recovery,
        recovery_acquisition=recovery.assign(coverage=0.125),
        training=pd.DataFrame(losses),
    )


def make_verdict(supported: bool) -> Verdict:
    status, reasons = (
        ("prior-supported", ()) if supported else ("not prior-supported", ("none of the draws",))
    )
    medians = dict.fromkeys(THETA_NAMES, 7.0)
    return Verdict(2.5, "auc_kpa", 1234, 500000, medians, status, "the verdict", reasons)
