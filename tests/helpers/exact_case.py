"""A model with a known posterior and proposals of any quality, for the tests of the exact posterior.

log phi is normal (the prior's bounds lie 6 standard deviations away) and the data are A log phi plus normal
noise, so posterior and evidence are normal and known.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import speed_case
from numpy.typing import NDArray
from scipy.stats import multivariate_normal

from swesbi.parameters import PHI_NAMES
from swesbi.posterior.adaptive import adapted
from swesbi.posterior.importance import LikelihoodModel, Proposal, WeightedDraws, points_of
from swesbi.posterior.settings import ExactSettings, McmcSettings
from swesbi.posterior.space import LogitSpace
from swesbi.prior import BoxPrior, JointPriorSettings, bounds, from_logit, log_centre, to_logit

FloatArray = NDArray[np.float64]
LOG_SD = 0.4
CENTRES = dict(zip(PHI_NAMES, (45.0, 5.0, 30.0, 2.2), strict=True))
MIXING = np.array(
    [
        [1.0, 0.8, 0.0, 0.0],
        [0.0, 1.0, -0.5, 0.0],
        [0.3, 0.0, 1.0, 0.2],
        [1.0, 1.0, 0.0, 1.0],
        [0.0, 0.0, 0.5, 1.0],
    ]
)
NOISE_SD = np.array([0.15, 0.2, 0.1, 0.15, 0.2])
TRAP_DEPTH = 20.0
OBSERVED = np.array([0.5, -0.2, 0.3, 0.4, 0.1])


def _part(name: str) -> dict[str, float]:
    centre, reach = CENTRES[name], float(np.exp(6.0 * LOG_SD))
    return {"centre": centre, "log_sd": LOG_SD, "low": centre / reach, "high": centre * reach}


PRIOR = JointPriorSettings.from_plain(
    {
        "theta": {name: _part(name) for name in PHI_NAMES[:3]},
        "passive_stiffness_kpa": _part(PHI_NAMES[3]),
    }
)
MCMC = McmcSettings(
    ensembles=4,
    walkers=32,
    steps=400,
    max_steps=4000,
    warm_up_fraction=0.25,
    max_r_hat=1.01,
    min_effective_draws=1000,
)
SETTINGS = ExactSettings(
    first_draws=1000,
    prior_fraction=0.1,
    round_draws=1500,
    max_rounds=30,
    effective_draws=1500,
    min_effective_draws=800,
    max_k_hat=0.7,
    draws=4000,
    interval=0.9,
    mcmc=MCMC,
)
SMALL = SETTINGS.model_copy(
    update={
        "first_draws": 500,
        "round_draws": 500,
        "max_rounds": 4,
        "effective_draws": 100,
        "min_effective_draws": 50,
        "draws": 800,
        "mcmc": SETTINGS.mcmc.model_copy(
            update={"walkers": 16, "steps": 24, "max_steps": 24, "max_r_hat": 9.0, "min_effective_draws": 1}
        ),
    }
)


def weigh(
    model: LikelihoodModel, network: Proposal, draws: int, prior_fraction: float, seed: int
) -> WeightedDraws:
    """Weight the draws of a network and of the prior: a first round, and no other."""
    sizes = {"first_draws": draws, "prior_fraction": prior_fraction, "max_rounds": 0}
    return adapted(model, SETTINGS.model_copy(update=sizes), seed, network).weighted  # type: ignore[arg-type]


@dataclass(frozen=True)
class ToySettings:
    prior: JointPriorSettings = PRIOR


@dataclass(frozen=True)
class ToyModel:
    """Simulations fail where k_0 is above ``fails_above``.

    With ``trap`` there is a second mode, that many prior standard deviations up in every parameter: of no
    mass (e^-20), but hard to leave.
    """

    fails_above: float = np.inf
    trap: float | None = None
    settings: ToySettings = field(default_factory=ToySettings)

    def log_likelihood(self, phi: FloatArray) -> FloatArray:
        log_phi = np.log(phi / log_centre(PRIOR))
        value = self._normal(OBSERVED - log_phi @ MIXING.T)
        if self.trap is not None:
            moved = log_phi - LOG_SD * self.trap
            lifted = 0.5 * ((log_phi / LOG_SD) ** 2).sum(axis=1)
            value = np.logaddexp(value, self._normal(OBSERVED - moved @ MIXING.T) + lifted - TRAP_DEPTH)
        return np.where(phi[:, 0] > self.fails_above, -np.inf, value)

    def _normal(self, residual: FloatArray) -> FloatArray:
        z = residual / NOISE_SD
        return -0.5 * (z**2).sum(axis=1) - np.log(NOISE_SD).sum() - 0.5 * len(NOISE_SD) * np.log(2 * np.pi)


def known_covariance() -> FloatArray:
    """Covariance of log phi."""
    return np.linalg.inv(MIXING.T @ (MIXING / NOISE_SD[:, None] ** 2) + np.eye(4) / LOG_SD**2)


def known_mean() -> FloatArray:
    """Mean of log phi."""
    return np.log(log_centre(PRIOR)) + known_covariance() @ MIXING.T @ (OBSERVED / NOISE_SD**2)


def known_log_evidence() -> float:
    covariance = LOG_SD**2 * MIXING @ MIXING.T + np.diag(NOISE_SD**2)
    return float(multivariate_normal(np.zeros(len(OBSERVED)), covariance).logpdf(OBSERVED))


@dataclass(frozen=True)
class LogNormal:
    """log phi ~ N(mean, covariance)."""

    mean: FloatArray
    covariance: FloatArray

    def draw(self, draws: int, seed: int) -> FloatArray:
        log_phi = np.random.default_rng(seed).multivariate_normal(self.mean, self.covariance, draws)
        return _inside(np.exp(log_phi))

    def log_density(self, phi: FloatArray) -> FloatArray:
        log_phi = np.log(phi)
        density = multivariate_normal(self.mean, self.covariance).logpdf(log_phi)
        return np.asarray(density - log_phi.sum(axis=1))

    def log_density_at(self, u: FloatArray, log_slope: FloatArray) -> FloatArray:
        return log_slope - 0.5 * (u**2 + np.log(2.0 * np.pi)).sum(axis=1)

    def place(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        log_phi, root = np.log(phi), np.linalg.cholesky(self.covariance)
        u = np.linalg.solve(root, (log_phi - self.mean).T).T
        return u, -log_phi.sum(axis=1) - np.log(np.diag(root)).sum()

    def at(self, u: FloatArray) -> FloatArray:
        log_phi = self.mean + u @ np.linalg.cholesky(self.covariance).T
        return _inside(np.exp(log_phi))


def _inside(phi: FloatArray) -> FloatArray:
    low, high = bounds(PRIOR)
    return np.clip(phi, np.nextafter(low, high), np.nextafter(high, low))


def proposal(width: float = 1.0, shift: float = 0.0) -> LogNormal:
    """Return the posterior itself with its spread scaled, moved by ``shift`` of its standard deviations."""
    direction = np.linalg.cholesky(known_covariance()) @ np.full(4, 0.5)
    return LogNormal(known_mean() + shift * direction, width**2 * known_covariance())


def check_posterior(phi: FloatArray, effective: float, weight: FloatArray | None = None) -> None:
    """Compare draws with the known posterior: mean and covariance within 4.5 Monte Carlo errors."""
    weight = np.full(len(phi), 1.0 / len(phi)) if weight is None else weight
    root = np.linalg.cholesky(known_covariance())
    standard = np.linalg.solve(root, (np.log(phi) - known_mean()).T)
    np.testing.assert_allclose(standard @ weight, 0.0, atol=4.5 / np.sqrt(effective))
    second = (standard * weight) @ standard.T
    np.testing.assert_allclose(second, np.eye(4), atol=4.5 * np.sqrt(2.0 / effective))


@dataclass(frozen=True)
class LogitNormal:
    """eta = logit(phi) is normal: a proposal for the speed model that needs no network."""

    mean: FloatArray
    covariance: FloatArray
    prior: BoxPrior

    def draw(self, draws: int, seed: int) -> FloatArray:
        eta = np.random.default_rng(seed).multivariate_normal(self.mean, self.covariance, draws)
        return from_logit(eta, self.prior)

    def log_density(self, phi: FloatArray) -> FloatArray:
        return self.log_density_at(*self.place(phi))

    def log_density_at(self, u: FloatArray, log_slope: FloatArray) -> FloatArray:
        return np.asarray(multivariate_normal(self.mean, self.covariance).logpdf(u) + log_slope)

    def place(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        return LogitSpace(self.prior).place(phi)

    def at(self, u: FloatArray) -> FloatArray:
        return LogitSpace(self.prior).at(u)


def fitted(model: LikelihoodModel, start: FloatArray = speed_case.PHI, draws: int = 2000) -> LogitNormal:
    """Return a normal fitted to the posterior of a recording, or of its heart, in two steps."""
    prior = model.settings.prior
    (eta,) = to_logit(points_of(model, start[None]), prior)
    current = LogitNormal(eta, np.diag([0.5, 0.5, 0.5, 0.2][: len(eta)]), prior)
    for step in range(2):
        weighted = weigh(model, current, draws, 0.1, step)
        eta = to_logit(points_of(model, weighted.phi), prior)
        mean = weighted.weight @ eta
        covariance = (eta - mean).T @ ((eta - mean) * weighted.weight[:, None])
        current = LogitNormal(mean, 1.2 * covariance, prior)
    return current
