"""An experiment of plain numbers, for the tests of the page."""

from __future__ import annotations

import math

import pandas as pd

from swesbi.parameters import THETA_NAMES, THETA_UNITS
from swesbi.report.results import Experiment, Recovery
from swesbi.report.study_tables import FEATURE_COLUMNS, POSTERIOR_COLUMNS, PPC_COLUMNS
from swesbi.verdict.verdict import Verdict

SETTINGS = {
    "posterior": {"interval": 0.9},
    "predictive": {"interval": 0.9},
    "support": {"max_abs_z": 3.0, "min_in_prior_draws": 1000, "candidate_draws": 500000},
    "summary": {"use_trajectory": True},
}


def make_experiment(name: str, supported: dict[str, bool], use_trajectory: bool = True) -> Experiment:
    """Return an experiment with plain numbers; scores of subjects not prior-supported are missing."""
    scores, posterior, features = [], [], []
    for subject, known in supported.items():
        one = 1.0 if known else math.nan
        scores.append(
            [
                *(
                    name,
                    subject,
                    known,
                    10.0,
                    *[one * value for value in (2, 80, 0.1, 0.99, 3, 0.6, 0.5)],
                    4.0,
                ),
                *(one * value for value in (0.6, 0.5, 0.9, 0.8)),
                *(0.7, 0.75),
            ]
        )
        features.append(
            [name, subject, known, "maximum_kpa", 40.0, 1.0, 30.0, 10.0, 50.0, one, one, one, known]
        )
        for parameter, unit in zip(THETA_NAMES, THETA_UNITS, strict=True):
            correlations = [one * -0.5] * 3
            row = [
                name,
                subject,
                known,
                parameter,
                unit,
                one * 5,
                one * 4,
                one * 6,
                math.nan,
                *correlations,
                7,
                8,
            ]
            posterior.append(row)
        posterior.append(
            [name, subject, known, "ejection_fraction", "1", one, one, one, 0.6, *[math.nan] * 5]
        )
    recovery = pd.DataFrame(
        [[p, level, 0.25, 0.2, 0.3, 400, -1.0, 0.9] for p in THETA_NAMES for level in (0.5, 0.9)],
        columns=["parameter", "nominal", "coverage", "ci_low", "ci_high", "n", "bias", "contraction"],
    )
    return Experiment(
        name=name,
        settings=SETTINGS | {"summary": {"use_trajectory": use_trajectory}},
        verdicts={subject: make_verdict(known) for subject, known in supported.items()},
        scores=pd.DataFrame(scores, columns=list(PPC_COLUMNS)),
        features=pd.DataFrame(features, columns=list(FEATURE_COLUMNS)),
        posterior=pd.DataFrame(posterior, columns=list(POSTERIOR_COLUMNS)),
        recovery=Recovery(recovery, recovery.assign(coverage=0.125)),
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
