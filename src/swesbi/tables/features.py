"""The checked features: observed value, predictive interval, inside or not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final

import pandas as pd

from swesbi.tables.case import Case

COLUMNS: Final = (
    "experiment",
    "subject",
    "supported",
    "feature",
    "observed",
    "noise_sd",
    "prior_median",
    "prior_pi_low",
    "prior_pi_high",
    "median",
    "pi_low",
    "pi_high",
    "inside",
)


def features_table(cases: Sequence[Case]) -> pd.DataFrame:
    """Return one row a subject, experiment and feature; values are in the unit that ends the feature's name.

    Intervals are those of a new observation, noise included. What concerns the posterior is missing where
    the subject is outside the prior's support.
    """
    return pd.DataFrame([row for case in cases for row in _rows(case)], columns=list(COLUMNS))


def _rows(case: Case) -> Iterator[dict[str, Any]]:
    check = case.check
    prior, posterior = check.prior.features.predicted, check.posterior.features.predicted
    missing = 1.0 if check.supported else float("nan")
    for j, name in enumerate(check.target.feature_names):
        yield {
            "experiment": case.experiment,
            "subject": case.subject,
            "supported": check.supported,
            "feature": name,
            "observed": check.target.features[j],
            "noise_sd": check.target.feature_noise_sd[j],
            "prior_median": prior.median[j],
            "prior_pi_low": prior.low[j],
            "prior_pi_high": prior.high[j],
            "median": missing * posterior.median[j],
            "pi_low": missing * posterior.low[j],
            "pi_high": missing * posterior.high[j],
            "inside": bool(check.posterior.features.inside[j]) if check.supported else None,
        }
