"""What figures, tables and the page show of experiments on speeds, made of plain draws."""

from __future__ import annotations

from dataclasses import replace

import evaluation_cases
import numpy as np
from numpy.typing import NDArray
from posterior_case import exact_of

from swesbi.checks.predictive import PredictiveCheck, withheld
from swesbi.posterior.result import ExactPosterior
from swesbi.prior import JointPriorSettings, bounds
from swesbi.report.figures.posterior import PosteriorPanel
from swesbi.report.figures.predictive import PredictivePanel
from swesbi.verdict.nulls import TESTS
from swesbi.verdict.verdict import Verdict, VerdictTest

FloatArray = NDArray[np.float64]
PRIOR = JointPriorSettings.from_plain(
    {
        "theta": evaluation_cases.PRIOR.to_plain(),
        "passive_stiffness_kpa": {"centre": 2.2, "log_sd": 0.4, "low": 0.5, "high": 8.0},
    }
)
STATUS = {"D": "doubtful", "E": "contradicted", "F": "contradicted"}
FLAGGED = {"D": ("residuals",), "E": ("boundary_mass",), "F": ("residuals", "boundary_mass")}


def phi(subject: str, n: int, width: float = 1.0, seed: int = 11) -> FloatArray:
    """Return draws about a subject's truth, within the prior's box."""
    rng = np.random.default_rng(seed)
    theta = evaluation_cases.posterior_theta(subject, n)
    spread = np.exp(0.05 * width * rng.standard_normal((n, 4)))
    joint = np.column_stack([theta, np.full(n, 2.1)]) * spread
    low, high = bounds(PRIOR)
    return np.clip(joint, 1.001 * low, 0.999 * high)


def verdict(subject: str) -> Verdict:
    status, flagged = STATUS.get(subject, "not contradicted"), FLAGGED.get(subject, ())
    tests = [
        VerdictTest(name, 1.5, 0.0002 if name in flagged else 0.4, 0.006, name in flagged, "in words")
        for name in TESTS
    ]
    tests.append(VerdictTest("end_systolic_volume", 1.2, None, 2.5, False, "42 mL, 45 measured"))
    return replace(
        evaluation_cases.verdict(subject, status != "contradicted"),
        sentence=f"{status}: {', '.join(flagged)}",
        reasons=flagged,
        status=status,
        tests=tuple(tests),
        k_hat=None if subject == "F" else 0.31,
        efficiency=0.82,
        sampler="mcmc" if subject == "F" else "importance",
    )


def result(subject: str, n: int = 800) -> ExactPosterior:
    draws, npe = phi(subject, n), phi(subject, n, width=1.4, seed=12)
    if subject == "F":
        check = {"k_hat": np.inf, "efficiency": 0.02, "r_hat": 1.004}
        return exact_of(draws, npe, sampler="mcmc", reasons=("k-hat",), **check)
    return exact_of(draws, npe, k_hat=0.31, efficiency=0.82)


def panel(subject: str, truth: bool = True) -> PosteriorPanel:
    fit = evaluation_cases.fit(subject).theta
    true = np.array(evaluation_cases.TRUE_THETA[subject], float) if truth else None
    return PosteriorPanel.of(subject, result(subject), verdict(subject), fit, true)


def check(subject: str) -> PredictiveCheck:
    """Return a check with draws for everyone, and scores for those who are not contradicted."""
    full = evaluation_cases.check(subject)
    if STATUS.get(subject) != "contradicted":
        return full
    return replace(full, may_be_read=False, posterior=withheld(full.posterior))


def predictive_panel(subject: str) -> PredictivePanel:
    return PredictivePanel(subject, check(subject), evaluation_cases.fit(subject), verdict(subject))
