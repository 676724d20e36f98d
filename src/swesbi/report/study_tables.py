"""The tables that the study writes of every subject: scores, features, posteriors, known truth."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
import pandas as pd

from swesbi.artefacts.csv import PlainTable
from swesbi.artefacts.typed import ByPlace, BySubject, Text
from swesbi.checks.cmaes import CmaesFit
from swesbi.checks.predictive import PredictiveCheck
from swesbi.checks.scores import band, reduction_percent
from swesbi.checks.truths import Truths
from swesbi.parameters import THETA, THETA_NAMES
from swesbi.posterior.truncated import Posterior
from swesbi.report.columns import named
from swesbi.report.results import PASSED
from swesbi.report.table import GROUP, Table, latex
from swesbi.report.tables.subjects import (
    DERIVED,
    POSTERIOR,
    SCORES,
    derived_of,
    parameters_of,
    with_mean,
)
from swesbi.verdict.summary import verdict_numbers
from swesbi.verdict.verdict import Verdict

LOGGER = logging.getLogger("swesbi")
TRUTH_COLUMNS: Final = (
    "experiment", "subject", "status", "parameter", "truth", "median", "low", "high", "inside",
)  # fmt: skip
Verdicts = Mapping[tuple[str, str], Verdict]
"""By (experiment, subject)."""


@dataclass(frozen=True)
class Case:
    """One subject in one experiment: predictive check, posterior, verdict, and the CMA-ES fit beside them."""

    experiment: str
    subject: str
    check: PredictiveCheck
    posterior: Posterior
    verdict: Verdict
    fit: CmaesFit

    @property
    def whose(self) -> dict[str, Any]:
        """The columns that begin every row."""
        return {
            "experiment": self.experiment,
            "subject": self.subject,
            "may_be_read": self.verdict.may_be_read,
        }

    def limits(self, median: float, low: float, high: float) -> dict[str, float]:
        """Return a posterior median and its credible interval, NaN where they may not be read."""
        values = np.array([median, low, high]) * (1.0 if self.verdict.may_be_read else np.nan)
        return dict(zip(("median", "ci_low", "ci_high"), values.tolist(), strict=True))


class StudyTables(NamedTuple):
    """The tables of every experiment, as CSV and LaTeX."""

    ppc_csv: PlainTable
    ppc_tex: Text
    features_csv: PlainTable
    posterior_csv: PlainTable
    posterior_tex: Text


def study_tables(
    predictives: ByPlace[PredictiveCheck],
    posteriors: ByPlace[Posterior],
    verdicts: ByPlace[Verdict],
    cmaes: BySubject[CmaesFit],
    *,
    cohort_title: str,
) -> StudyTables:
    """Tabulate every experiment; who has a predictive check has rows, in the order of the checks."""
    cases = [
        Case(*place, check, posteriors[place], verdicts[place], cmaes[place.subject])
        for place, check in predictives.items()
    ]
    judged = {(case.experiment, case.subject): case.verdict for case in cases}
    scores, inferred = ppc_table(cases), posterior_table(cases)
    return StudyTables(
        ppc_csv=scores,
        ppc_tex=ppc_latex(scores, judged, cohort_title),
        features_csv=features_table(cases),
        posterior_csv=inferred,
        posterior_tex=posterior_latex(inferred, judged, cohort_title),
    )


def beside_the_truth(posteriors: ByPlace[Posterior], verdicts: ByPlace[Verdict], truth: Truths) -> PlainTable:
    """Tabulate credible intervals of every experiment and subject beside the truth of a generated cohort.

    ``low`` and ``high`` are the ends of the credible interval; they, the median and ``inside`` are missing
    where the subject may not be read. Subjects without a known truth are left out.
    """
    rows = []
    for place, posterior in posteriors.items():
        verdict = verdicts[place]
        reported = 1.0 if verdict.may_be_read else np.nan
        for j, true in enumerate(truth.get(place.subject, ())):
            low, high = posterior.interval[j]
            inside = bool(low <= true <= high) if verdict.may_be_read else None
            values = reported * np.array([posterior.median[j], low, high])
            rows.append((*place, verdict.status, THETA_NAMES[j], true, *values, inside))
    table = pd.DataFrame(rows, columns=list(TRUTH_COLUMNS))
    for experiment, part in table.dropna(subset="inside").groupby("experiment", sort=False):
        found = part["inside"].astype(bool)
        LOGGER.info("%s: %d of %d true parameters inside", experiment, found.sum(), len(found))
    return table


def ppc_table(cases: Sequence[Case]) -> pd.DataFrame:
    """Return one row a subject and experiment.

    The scores of the posterior are NaN where the subject is outside the prior's support. Of the observed
    curve, ``coverage_noiseless_*`` is what the band of noiseless curves holds, ``coverage_observed_*`` what
    the interval under the experiment's observation model holds. ``coverage_grid`` and ``coverage_phases``
    are the first in an experiment on features, the second in one on speeds. The last two columns are the
    ceiling: what the band and the envelope of the prior's noiseless curves hold.
    """
    return pd.DataFrame([_row(case) for case in cases])


def _row(case: Case) -> dict[str, Any]:
    prior, posterior = case.check.prior, case.check.posterior
    grid, phases, scores = posterior.coverages, posterior.phase_coverages, posterior.scores
    return {
        **case.whose,
        "rmse_prior_kpa": prior.scores.rmse_kpa,
        "rmse_kpa": scores.rmse_kpa,
        "rmse_reduction_percent": reduction_percent(prior.scores.rmse_kpa, scores.rmse_kpa),
        "nrmse": scores.nrmse,
        "r2": scores.r2,
        "post_peak_rmse_kpa": scores.post_peak_rmse_kpa,
        "coverage_grid": scores.coverage,
        "coverage_phases": posterior.phase_scores.coverage,
        "rmse_cmaes_kpa": case.fit.rmse_kpa,
        "coverage_noiseless_grid": grid.noiseless,
        "coverage_noiseless_phases": phases.noiseless,
        "coverage_observed_grid": grid.observed,
        "coverage_observed_phases": phases.observed,
        "coverage_prior_band_grid": prior.coverages.noiseless,
        "coverage_prior_envelope_grid": prior.coverages.envelope,
    }


def features_table(cases: Sequence[Case]) -> pd.DataFrame:
    """Return one row a subject, experiment and feature; values are in the unit that ends the feature's name.

    Intervals are those of a new observation, noise included. What concerns the posterior is missing where
    the subject is outside the prior's support.
    """
    table = pd.concat([_features(case) for case in cases], ignore_index=True)
    of_posterior = ["median", "pi_low", "pi_high", "inside"]
    table[of_posterior] = table[of_posterior].where(table["may_be_read"])
    return table


def _features(case: Case) -> pd.DataFrame:
    target, prior, posterior = case.check.target, case.check.prior.features, case.check.posterior.features
    columns = {
        "feature": list(target.feature_names),
        "observed": target.features,
        "noise_sd": target.feature_noise_sd,
        "prior_median": prior.predicted.median,
        "prior_pi_low": prior.predicted.low,
        "prior_pi_high": prior.predicted.high,
        "median": posterior.predicted.median,
        "pi_low": posterior.predicted.low,
        "pi_high": posterior.predicted.high,
        "inside": posterior.inside,
    }
    return pd.DataFrame(case.whose | columns)


def posterior_table(cases: Sequence[Case]) -> pd.DataFrame:
    """Return one row a subject, experiment and quantity.

    The three parameters come first, with their correlations, the median of all candidates (filtered by no
    bound) and the CMA-ES fit; then quantities derived from the posterior predictive simulations: ejection
    fraction, volumes, peak stiffness and isometric stiffness k_0 (1 - exp(-k_ATP D_T)), beside what was
    measured of them. LVEDV sets the simulator's size, but neither it nor LVESV is fitted. Posterior values
    are NaN where the subject is outside the prior's support.
    """
    return pd.DataFrame([row for case in cases for row in (*_parameters(case), *_derived(case))])


def _parameters(case: Case) -> Iterator[dict[str, Any]]:
    posterior, known = case.posterior, 1.0 if case.verdict.may_be_read else np.nan
    for j, parameter in enumerate(THETA):
        correlations = zip(THETA_NAMES, known * posterior.correlation[j], strict=True)
        yield {
            **case.whose,
            "parameter": parameter.name,
            "unit": parameter.unit,
            **case.limits(posterior.median[j], *posterior.interval[j]),
            "measured": np.nan,
            **{f"correlation_{other}": value for other, value in correlations},
            "unfiltered_median": case.verdict.unfiltered_median[parameter.name],
            "cmaes": case.fit.theta[j],
        }


def _derived(case: Case) -> Iterator[dict[str, Any]]:
    draws, target = case.check.posterior.draws, case.check.target
    quantities = {
        ("ejection_fraction", "1"): (draws.ejection_fraction, 1.0 - target.lvesv_ml / target.lvedv_ml),
        ("end_diastolic_volume_ml", "mL"): (draws.end_diastolic_volume_ml, target.lvedv_ml),
        ("end_systolic_volume_ml", "mL"): (draws.end_systolic_volume_ml, target.lvesv_ml),
        ("peak_stiffness_kpa", "kPa"): (draws.curve_kpa.max(axis=1), target.curve_kpa.max()),
        ("isometric_stiffness_kpa", "kPa"): (draws.isometric_stiffness_kpa, np.nan),
    }
    for (name, unit), (values, measured) in quantities.items():
        found = band(values[:, None], case.posterior.interval_mass)
        limits = case.limits(found.median[0], found.low[0], found.high[0])
        yield {**case.whose, "parameter": name, "unit": unit, **limits, "measured": measured}


def ppc_latex(scores: pd.DataFrame, verdicts: Verdicts, cohort_title: str) -> str:
    """Return table 1 of every experiment; scores are as ``ppc_table`` returns them."""
    parts = []
    for experiment, part in scores.groupby("experiment", sort=False):
        passed = [verdicts[str(experiment), subject].status in PASSED for subject in part["subject"]]
        parts.append(with_mean(part, part[passed]).assign(**{GROUP: experiment}))
    table = Table(
        f"Posterior predictive performance ({cohort_title}).",
        pd.concat(parts),
        named("subject", *SCORES),
        "Coverage: share of the observed curve in the band of noiseless curves, or in the interval of new "
        "observations. The prior's band and envelope are the ceiling of the first. Mean and standard "
        f"deviation: of subjects whose answers may be read without care. {_excluded(verdicts)}",
    )
    return latex(table, "ppc")


def posterior_latex(posterior: pd.DataFrame, verdicts: Verdicts, cohort_title: str) -> str:
    """Return the posteriors of every experiment: the parameters, then what follows from them.

    ``posterior`` is as ``posterior_table`` returns it.
    """
    table = posterior.assign(**{GROUP: posterior["experiment"]})
    parameters = Table(
        f"Posteriors of the parameters ({cohort_title}).",
        parameters_of(table),
        named("subject", "parameter", "unit", *POSTERIOR),
        _excluded(verdicts),
    )
    derived = Table(
        f"What follows from the posteriors in the simulated beat ({cohort_title}).",
        derived_of(table),
        named(*DERIVED),
        "Measured volumes are those of the subject's context; none of them is fitted.",
    )
    return latex(parameters, "posterior") + "\n" + latex(derived, "derived")


def _excluded(verdicts: Verdicts) -> str:
    """Return who is excluded, and why."""
    excluded = [
        f"{experiment} {subject} ({', '.join(verdict_numbers(verdict))})"
        for (experiment, subject), verdict in verdicts.items()
        if not verdict.may_be_read
    ]
    return f"Excluded: {'; '.join(excluded)}." if excluded else ""
