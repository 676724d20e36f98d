"""Table 1: the predictive scores of every subject in every experiment."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import pandas as pd

from swesbi.evaluation.scores import reduction_percent
from swesbi.tables.case import Case

COLUMNS: Final = (
    "experiment",
    "subject",
    "supported",
    "rmse_prior_kpa",
    "rmse_kpa",
    "rmse_reduction_percent",
    "nrmse",
    "r2",
    "post_peak_rmse_kpa",
    "coverage_grid",
    "coverage_phases",
    "rmse_cmaes_kpa",
)


def ppc_table(cases: Sequence[Case]) -> pd.DataFrame:
    """Return one row a subject and experiment.

    The scores of the posterior are NaN where the subject is outside the prior's support.
    """
    return pd.DataFrame([_row(case) for case in cases], columns=list(COLUMNS))


def _row(case: Case) -> dict[str, Any]:
    prior, posterior = case.check.prior.scores, case.check.posterior.scores
    return {
        "experiment": case.experiment,
        "subject": case.subject,
        "supported": case.check.supported,
        "rmse_prior_kpa": prior.rmse_kpa,
        "rmse_kpa": posterior.rmse_kpa,
        "rmse_reduction_percent": reduction_percent(prior.rmse_kpa, posterior.rmse_kpa),
        "nrmse": posterior.nrmse,
        "r2": posterior.r2,
        "post_peak_rmse_kpa": posterior.post_peak_rmse_kpa,
        "coverage_grid": posterior.coverage,
        "coverage_phases": case.check.posterior.phase_scores.coverage,
        "rmse_cmaes_kpa": case.fit.rmse_kpa,
    }
