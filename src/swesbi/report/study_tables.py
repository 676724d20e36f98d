"""The tables that the study writes of every subject: scores, features, posteriors, known truth."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.checks.cmaes import CmaesFit
from swesbi.checks.predictive import PredictiveCheck
from swesbi.checks.scores import band, reduction_percent
from swesbi.parameters import THETA_NAMES, THETA_UNITS
from swesbi.posterior.truncated import Posterior
from swesbi.verdict.verdict import Verdict

PPC_COLUMNS: Final = (
    "experiment", "subject", "may_be_read", "rmse_prior_kpa", "rmse_kpa", "rmse_reduction_percent", "nrmse",
    "r2", "post_peak_rmse_kpa", "coverage_grid", "coverage_phases", "rmse_cmaes_kpa",
    "coverage_noiseless_grid", "coverage_noiseless_phases", "coverage_observed_grid",
    "coverage_observed_phases", "coverage_prior_band_grid", "coverage_prior_envelope_grid",
)  # fmt: skip
CEILING: Final = PPC_COLUMNS[-2:]
"""What the prior's own band, and the envelope of all its draws, hold of the observed curve."""
FEATURE_COLUMNS: Final = (
    "experiment", "subject", "may_be_read", "feature", "observed", "noise_sd", "prior_median", "prior_pi_low",
    "prior_pi_high", "median", "pi_low", "pi_high", "inside",
)  # fmt: skip
FloatArray = NDArray[np.float64]
CORRELATIONS: Final = tuple(f"correlation_{name}" for name in THETA_NAMES)
POSTERIOR_COLUMNS: Final = (
    "experiment", "subject", "may_be_read", "parameter", "unit", "median", "ci_low", "ci_high", "measured",
    *CORRELATIONS, "unfiltered_median", "cmaes",
)  # fmt: skip
TRUTH_COLUMNS: Final = (
    "experiment", "subject", "status", "parameter", "truth", "median", "low", "high", "inside",
)  # fmt: skip


@dataclass(frozen=True)
class Case:
    """One subject in one experiment: predictive check, posterior, verdict, and the CMA-ES fit beside them."""

    experiment: str
    subject: str
    check: PredictiveCheck
    posterior: Posterior
    verdict: Verdict
    fit: CmaesFit


def ppc_table(cases: Sequence[Case]) -> pd.DataFrame:
    """Return one row a subject and experiment.

    The scores of the posterior are NaN where the subject is outside the prior's support. Of the observed
    curve, ``coverage_noiseless_*`` is what the band of noiseless curves holds, ``coverage_observed_*`` what
    the interval under the experiment's observation model holds. ``coverage_grid`` and ``coverage_phases``
    are the first in an experiment on features, the second in one on speeds. The last two columns are the
    ceiling: what the band and the envelope of the prior's noiseless curves hold.
    """
    return pd.DataFrame([_row(case) for case in cases], columns=list(PPC_COLUMNS))


def _row(case: Case) -> dict[str, Any]:
    prior, posterior = case.check.prior.scores, case.check.posterior.scores
    return {
        "experiment": case.experiment,
        "subject": case.subject,
        "may_be_read": case.check.may_be_read,
        "rmse_prior_kpa": prior.rmse_kpa,
        "rmse_kpa": posterior.rmse_kpa,
        "rmse_reduction_percent": reduction_percent(prior.rmse_kpa, posterior.rmse_kpa),
        "nrmse": posterior.nrmse,
        "r2": posterior.r2,
        "post_peak_rmse_kpa": posterior.post_peak_rmse_kpa,
        "coverage_grid": posterior.coverage,
        "coverage_phases": case.check.posterior.phase_scores.coverage,
        "rmse_cmaes_kpa": case.fit.rmse_kpa,
        **_coverages(case.check),
    }


def _coverages(check: PredictiveCheck) -> dict[str, float]:
    grid, phases = check.posterior.coverages, check.posterior.phase_coverages
    return {
        "coverage_noiseless_grid": grid.noiseless,
        "coverage_noiseless_phases": phases.noiseless,
        "coverage_observed_grid": grid.observed,
        "coverage_observed_phases": phases.observed,
        "coverage_prior_band_grid": check.prior.coverages.noiseless,
        "coverage_prior_envelope_grid": check.prior.coverages.envelope,
    }


def features_table(cases: Sequence[Case]) -> pd.DataFrame:
    """Return one row a subject, experiment and feature; values are in the unit that ends the feature's name.

    Intervals are those of a new observation, noise included. What concerns the posterior is missing where
    the subject is outside the prior's support.
    """
    return pd.DataFrame([row for case in cases for row in _feature_rows(case)], columns=list(FEATURE_COLUMNS))


def _feature_rows(case: Case) -> Iterator[dict[str, Any]]:
    check = case.check
    prior, posterior = check.prior.features.predicted, check.posterior.features.predicted
    missing = 1.0 if check.may_be_read else float("nan")
    for j, name in enumerate(check.target.feature_names):
        yield {
            "experiment": case.experiment,
            "subject": case.subject,
            "may_be_read": check.may_be_read,
            "feature": name,
            "observed": check.target.features[j],
            "noise_sd": check.target.feature_noise_sd[j],
            "prior_median": prior.median[j],
            "prior_pi_low": prior.low[j],
            "prior_pi_high": prior.high[j],
            "median": missing * posterior.median[j],
            "pi_low": missing * posterior.low[j],
            "pi_high": missing * posterior.high[j],
            "inside": bool(check.posterior.features.inside[j]) if check.may_be_read else None,
        }


def posterior_table(cases: Sequence[Case]) -> pd.DataFrame:
    """Return one row a subject, experiment and quantity.

    The three parameters come first, with their correlations, the median of all candidates (filtered by no
    bound) and the CMA-ES fit; then quantities derived from the posterior predictive simulations: ejection
    fraction, volumes, peak stiffness and isometric stiffness k_0 (1 - exp(-k_ATP D_T)), beside what was
    measured of them. LVEDV sets the simulator's size, but neither it nor LVESV is fitted. Posterior values
    are NaN where the subject is outside the prior's support.
    """
    rows = [row for case in cases for row in (*_parameters(case), *_derived(case))]
    return pd.DataFrame(rows, columns=list(POSTERIOR_COLUMNS))


def _parameters(case: Case) -> Iterator[dict[str, Any]]:
    posterior = case.posterior
    missing = 1.0 if case.verdict.may_be_read else np.nan
    for j, (name, unit) in enumerate(zip(THETA_NAMES, THETA_UNITS, strict=True)):
        low, high = missing * posterior.interval[j]
        correlations = zip(CORRELATIONS, missing * posterior.correlation[j], strict=True)
        yield {
            **_identity(case, name, unit),
            "median": missing * posterior.median[j],
            "ci_low": low,
            "ci_high": high,
            **dict(correlations),
            "unfiltered_median": case.verdict.unfiltered_median[name],
            "cmaes": case.fit.theta[j],
        }


def _derived(case: Case) -> Iterator[dict[str, Any]]:
    draws = case.check.posterior.draws
    target = case.check.target
    missing = 1.0 if case.verdict.may_be_read else np.nan
    measured_fraction = 1.0 - target.lvesv_ml / target.lvedv_ml
    quantities = {
        ("ejection_fraction", "1"): (draws.ejection_fraction, measured_fraction),
        ("end_diastolic_volume_ml", "mL"): (draws.end_diastolic_volume_ml, target.lvedv_ml),
        ("end_systolic_volume_ml", "mL"): (draws.end_systolic_volume_ml, target.lvesv_ml),
        ("peak_stiffness_kpa", "kPa"): (draws.curve_kpa.max(axis=1), target.curve_kpa.max()),
        ("isometric_stiffness_kpa", "kPa"): (draws.isometric_stiffness_kpa, np.nan),
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
        "may_be_read": case.verdict.may_be_read,
        "parameter": name,
        "unit": unit,
    }


@dataclass(frozen=True)
class JudgedPosterior:
    """The posterior of one subject in one experiment, with its verdict."""

    experiment: str
    subject: str
    posterior: Posterior
    verdict: Verdict


def truth_table(answers: Sequence[JudgedPosterior], truths: Mapping[str, FloatArray]) -> pd.DataFrame:
    """Return one row an experiment, subject and active parameter.

    ``low`` and ``high`` are the ends of the credible interval; they and the median are missing where the
    posterior may not be read, and is not reported. Subjects without a known truth have no row.

    Args:
        answers: Posteriors.
        truths: True theta (3,) by subject.
    """
    rows = [row for answer in answers if answer.subject in truths for row in _truth_rows(answer, truths)]
    return pd.DataFrame(rows, columns=list(TRUTH_COLUMNS))


def _truth_rows(answer: JudgedPosterior, truths: Mapping[str, FloatArray]) -> Iterator[dict[str, Any]]:
    reported = 1.0 if answer.verdict.may_be_read else np.nan
    for j, name in enumerate(THETA_NAMES):
        truth = float(truths[answer.subject][j])
        low, high = reported * answer.posterior.interval[j]
        yield {
            "experiment": answer.experiment,
            "subject": answer.subject,
            "status": answer.verdict.status,
            "parameter": name,
            "truth": truth,
            "median": reported * answer.posterior.median[j],
            "low": low,
            "high": high,
            "inside": bool(low <= truth <= high) if answer.verdict.may_be_read else None,
        }
