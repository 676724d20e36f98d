"""The posteriors in numbers: medians, credible intervals, correlations, and what a cardiologist reads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.evaluation.scores import band
from swesbi.parameters import THETA_NAMES, THETA_UNITS
from swesbi.tables.case import Case

FloatArray = NDArray[np.float64]

CORRELATIONS: Final = tuple(f"correlation_{name}" for name in THETA_NAMES)
COLUMNS: Final = (
    "experiment",
    "subject",
    "supported",
    "parameter",
    "unit",
    "median",
    "ci_low",
    "ci_high",
    "measured",
    *CORRELATIONS,
    "unfiltered_median",
    "cmaes",
)


def posterior_table(cases: Sequence[Case]) -> pd.DataFrame:
    """Return one row a subject, experiment and quantity.

    The three parameters come first, with their correlations, the median of all candidates (filtered by no
    bound) and the CMA-ES fit; then quantities derived from the posterior predictive simulations: ejection
    fraction, volumes, peak stiffness and attained stiffness k_0 (1 - exp(-k_ATP D_T)), beside what was
    measured of them. LVEDV sets the simulator's size, but neither it nor LVESV is fitted. Posterior values
    are NaN where the subject is outside the prior's support.
    """
    rows = [row for case in cases for row in (*_parameters(case), *_derived(case))]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _parameters(case: Case) -> Iterator[dict[str, Any]]:
    posterior = case.posterior
    missing = 1.0 if case.support.supported else np.nan
    for j, (name, unit) in enumerate(zip(THETA_NAMES, THETA_UNITS, strict=True)):
        low, high = missing * posterior.interval[j]
        correlations = zip(CORRELATIONS, missing * posterior.correlation[j], strict=True)
        yield {
            **_identity(case, name, unit),
            "median": missing * posterior.median[j],
            "ci_low": low,
            "ci_high": high,
            **dict(correlations),
            "unfiltered_median": case.support.unfiltered_median[name],
            "cmaes": case.fit.theta[j],
        }


def _derived(case: Case) -> Iterator[dict[str, Any]]:
    draws = case.check.posterior.draws
    target = case.check.target
    missing = 1.0 if case.support.supported else np.nan
    measured_fraction = 1.0 - target.lvesv_ml / target.lvedv_ml
    quantities = {
        ("ejection_fraction", "1"): (draws.ejection_fraction, measured_fraction),
        ("end_diastolic_volume_ml", "mL"): (draws.end_diastolic_volume_ml, target.lvedv_ml),
        ("end_systolic_volume_ml", "mL"): (draws.end_systolic_volume_ml, target.lvesv_ml),
        ("peak_stiffness_kpa", "kPa"): (draws.curve_kpa.max(axis=1), target.curve_kpa.max()),
        ("attained_stiffness_kpa", "kPa"): (draws.attained_stiffness_kpa, np.nan),
    }
    for (name, unit), (values, measured) in quantities.items():
        summary = band(values[:, None], case.posterior.interval_mass)
        interval = {"ci_low": missing * summary.low[0], "ci_high": missing * summary.high[0]}
        center = {"median": missing * summary.median[0], "measured": measured}
        yield {**_identity(case, name, unit), **center, **interval}


def _identity(case: Case, name: str, unit: str) -> dict[str, Any]:
    return {
        "experiment": case.experiment,
        "subject": case.subject,
        "supported": case.support.supported,
        "parameter": name,
        "unit": unit,
    }
