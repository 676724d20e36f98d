"""Synthetic subjects by a closed-form stand-in: stiffness rises with k_0 and k_ATP, and falls with k_SR."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swesbi.checks.cmaes import CmaesFit, best_run, curve_loss, gather, run_searches
from swesbi.checks.predictive import Draws, PredictiveCheck, Target, predict
from swesbi.checks.predictive_features import replicates
from swesbi.checks.settings import CmaesSettings, CurveLossSettings
from swesbi.parameters import THETA_NAMES
from swesbi.prior import PriorSettings, bounds, quantile
from swesbi.report.figures.posterior import PosteriorPanel
from swesbi.report.figures.predictive import PredictivePanel
from swesbi.verdict.verdict import Verdict

FloatArray = NDArray[np.float64]
GRID = np.linspace(0.0, 1.0, 100)
PHASE = (np.arange(20) + 0.3) / 20.0
PERIOD_S = 0.9
FEATURES = ("maximum_kpa", "auc_kpa", "time_to_peak_cycle")
FEATURE_NOISE_SD = np.array([1.0, 0.5, 0.03])
INTERVAL = 0.9
TITLE = "virtual volunteers"
LOSS = CurveLossSettings(mae_weight=1.0, correlation_weight=1.0, peak_weight=1.0)
PRIOR = PriorSettings.from_plain(
    {
        "k0_kpa": {"centre": 45.0, "log_sd": 0.5, "low": 10.0, "high": 200.0},
        "k_atp_per_s": {"centre": 5.0, "log_sd": 0.6, "low": 2.0, "high": 30.0},
        "k_sr_per_s": {"centre": 30.0, "log_sd": 0.45, "low": 2.0, "high": 60.0},
    }
)
TRUE_THETA = dict(
    A=(58, 6, 28), B=(78, 6.5, 30), C=(82, 7, 33), D=(86, 5.5, 18), E=(58, 38, 30), F=(60, 80, 30)
)


def curves(theta: FloatArray, phase: FloatArray = GRID) -> FloatArray:
    """Total stiffness (n, points) of theta (n, 3)."""
    k0, k_atp, k_sr = (np.asarray(theta, float)[:, [j]] for j in range(3))
    t = PERIOD_S * phase - 0.04
    rise = 1.0 - np.exp(-k_atp * np.clip(t, 0.0, 0.34))
    return 4.5 + k0 * rise * np.exp(-k_sr * np.clip(t - 0.34, 0.0, None) / 3.0)


def draws(theta: FloatArray) -> Draws:
    curve = curves(theta)
    features = np.stack([curve.max(axis=1), curve.mean(axis=1), GRID[curve.argmax(axis=1)]], axis=1)
    volumes = (np.full(len(theta), 100.0), np.full(len(theta), 40.0))
    return Draws(theta, curve, curves(theta, PHASE), features, *volumes, theta[:, 0], 0)


def target(subject: str = "A", noise: float = 0.05) -> Target:
    truth = np.array([TRUE_THETA.get(subject, TRUE_THETA["B"])], float)
    rng, measured = np.random.default_rng(sum(map(ord, subject))), np.arange(20) != 7
    factor = 1.0 + noise * rng.standard_normal(PHASE.size)
    stiffness = np.where(measured, curves(truth, PHASE)[0] * factor, np.nan)
    curve = np.interp(GRID, PHASE[measured], stiffness[measured], period=1.0)
    observed = np.array([curve.max(), curve.mean(), GRID[curve.argmax()]])
    recorded = (GRID, curve, PHASE, measured, stiffness, 0.05 * stiffness)
    return Target(*recorded, observed, FEATURES, FEATURE_NOISE_SD, lvedv_ml=105.0, lvesv_ml=40.0)


def check(subject: str = "A", supported: bool = True, n: int = 200) -> PredictiveCheck:
    observation = target(subject)
    prior = draws(quantile(np.random.default_rng(1).random((n, 3)), PRIOR))
    posterior = draws(posterior_theta(subject, n if supported else 0))
    noise = dict(zip(FEATURES, FEATURE_NOISE_SD.tolist(), strict=True))
    parts = [
        predict(replicates(part, observation, noise, 5, subject, of), observation, INTERVAL, of_new=False)
        for of, part in (("prior", prior), ("posterior", posterior))
    ]
    return PredictiveCheck(observation, INTERVAL, supported, *parts)


def posterior_theta(subject: str, n: int) -> FloatArray:
    """Correlated log-normal draws about the truth, k_0 against k_ATP at -0.85."""
    rng = np.random.default_rng(7)
    covariance = np.array([[1.0, -0.85, 0.1], [-0.85, 1.0, 0.0], [0.1, 0.0, 1.0]])
    z = rng.multivariate_normal(np.zeros(3), covariance, n)
    return np.array(TRUE_THETA.get(subject, TRUE_THETA["B"])) * np.exp(z * np.array([0.04, 0.07, 0.12]))


def cmaes_settings(seeds: tuple[int, ...] = (200, 201), generations: int = 40) -> CmaesSettings:
    return CmaesSettings(seeds=seeds, population_size=12, generations=generations, sigma0=0.3, loss=LOSS)


def fit(subject: str = "A", settings: CmaesSettings | None = None) -> CmaesFit:
    observed = target(subject).curve_kpa
    runs = run_searches(
        lambda theta: curve_loss(curves(theta), observed, LOSS), *bounds(PRIOR), settings or cmaes_settings()
    )
    return gather(runs, curves(best_run(runs).theta[None])[0], GRID, observed)


def verdict(subject: str = "A", supported: bool = True) -> Verdict:
    median = TRUE_THETA.get(subject, TRUE_THETA["B"])
    reasons = () if supported else ("0 of 500000 candidate draws lie within the prior's bounds",)
    return Verdict(
        max_abs_z=1.8 if supported else 3.14,
        worst_component="amplitude_kpa",
        in_prior_draws=480_123 if supported else 0,
        candidate_draws=500_000,
        unfiltered_median=dict(zip(THETA_NAMES, map(float, median), strict=True)),
        status="prior-supported" if supported else "not prior-supported",
        sentence="prior-supported" if supported else "not prior-supported",
        reasons=reasons,
    )


def predictive_panels(subjects: str = "ABCDEF", excluded: str = "EF") -> list[PredictivePanel]:
    return [
        PredictivePanel(s, check(s, s not in excluded), fit(s), verdict(s, s not in excluded))
        for s in subjects
    ]


def posterior_panels(subjects: str = "ABCDEF", excluded: str = "EF") -> list[PosteriorPanel]:
    return [
        PosteriorPanel(s, verdict(s, s not in excluded), posterior_theta(s, 2000), INTERVAL, fit(s).theta)
        for s in subjects
    ]
