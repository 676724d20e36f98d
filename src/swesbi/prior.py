"""The bounded log-Gaussian priors of theta and of phi, and the map of their box onto the whole space.

Parameters are independent. Inside its bounds, the logarithm of each is normal around log(centre) with the
given standard deviation; outside, the density is zero (paper, Sec. 2.4). The density is normalised over the
box, which the logit maps onto R^d. Every function takes a prior of theta as it takes one of phi.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Protocol

import numpy as np
from pydantic import Field

from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.base.settings import Settings
from swesbi.parameters import (
    NUISANCES,
    OF_THETA,
    OPERATOR_NAMES,
    PHI_NAMES,
    PHYSIOLOGY_NAMES,
    STRETCHED,
    THETA_NAMES,
    NuisanceSettings,
    ParameterPrior,
)

VARIANCE_POINTS: Final = 100_000
SOBOL_POWER: Final = 16


class PriorSettings(Settings):
    """The prior of theta = (k_0, k_ATP, k_SR), and of the nuisance parameters that are free beside it.

    The form is bounded log-Gaussian, independent (paper, Sec. 2.4).
    """

    k0_kpa: ParameterPrior = Field(description="Prior of k_0, the active stiffness scale (paper, Sec. 2.4).")
    k_atp_per_s: ParameterPrior = Field(
        description="Prior of k_ATP, the contraction rate (paper, Sec. 2.4). That of `wide` is wider: "
        "wider priors shifted k_ATP and degraded coverage (paper, Sec. 3). Its width is chosen."
    )
    k_sr_per_s: ParameterPrior = Field(
        description="Prior of k_SR, the relaxation rate (paper, Sec. 2.4). That of `wide` is wider, by a "
        "chosen width."
    )
    nuisances: NuisanceSettings = Field(
        default=NuisanceSettings(),
        description="Nuisance parameters that are free, each by its prior. They are integrated out.",
    )

    @property
    def parameters(self) -> tuple[ParameterPrior, ...]:
        """The priors in the order of ``THETA_NAMES``."""
        return tuple(getattr(self, name) for name in THETA_NAMES)

    @property
    def physiology_names(self) -> tuple[str, ...]:
        """Nuisance parameters that the simulation takes; k of them."""
        return tuple(self.nuisances.freed(PHYSIOLOGY_NAMES))


class SimulatedPrior(Settings):
    """What the simulation takes: theta, and the k free parameters of physiology."""

    theta: PriorSettings

    @property
    def parameters(self) -> tuple[ParameterPrior, ...]:
        """The priors of theta, then of physiology."""
        return (*self.theta.parameters, *self.theta.nuisances.freed(PHYSIOLOGY_NAMES).values())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the 3 + k parameters."""
        return (*THETA_NAMES, *self.theta.physiology_names)


class OperatorPrior(Settings):
    """What the measurement takes: the passive stiffness, and the free parameters of the measurement."""

    passive: ParameterPrior
    nuisances: NuisanceSettings

    @property
    def parameters(self) -> tuple[ParameterPrior, ...]:
        """The prior of the passive stiffness, then of the others."""
        return (self.passive, *self.nuisances.freed(OPERATOR_NAMES).values())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the o parameters."""
        return (PHI_NAMES[STRETCHED], *self.nuisances.freed(OPERATOR_NAMES))


class JointPriorSettings(Settings):
    """Bounded log-Gaussian priors of phi = (theta, a, nuisances), independent; d parameters."""

    theta: PriorSettings
    passive_stiffness_kpa: ParameterPrior = Field(
        description="prior of the passive stiffness a at the beat's largest stretch, in kPa"
    )

    @property
    def parameters(self) -> tuple[ParameterPrior, ...]:
        """The priors in the order of ``names``."""
        return (*self.theta.parameters, self.passive_stiffness_kpa, *self._nuisances.values())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the d parameters: theta, a, and the nuisance parameters that are free."""
        return (*PHI_NAMES, *self._nuisances)

    @property
    def nuisance_names(self) -> tuple[str, ...]:
        """Names of the d - 4 nuisance parameters that are free beside the passive stiffness."""
        return tuple(self._nuisances)

    @property
    def simulated(self) -> SimulatedPrior:
        """The prior of what the simulation takes."""
        return SimulatedPrior(theta=self.theta)

    @property
    def operator(self) -> OperatorPrior:
        """The prior of what the measurement takes."""
        return OperatorPrior(passive=self.passive_stiffness_kpa, nuisances=self.theta.nuisances)

    @property
    def _nuisances(self) -> dict[str, ParameterPrior]:
        return self.theta.nuisances.freed(parameter.name for parameter in NUISANCES)

    def column(self, phi: FloatArray, name: str) -> FloatArray | None:
        """Return one parameter of phi (..., d) by its name, of shape (...); None where it is fixed."""
        names = self.names
        return phi[..., names.index(name)] if name in names else None

    def physiology(self, phi: FloatArray) -> FloatArray:
        """Return the k columns of phi (..., d) that the simulation takes beside theta; (..., k)."""
        start = len(PHI_NAMES)
        return phi[..., start : start + len(self.theta.physiology_names)]

    def heart(self, phi: FloatArray) -> FloatArray:
        """Return the 3 + k columns of phi (n, d) that the simulation takes; (n, 3 + k)."""
        return np.hstack([phi[:, OF_THETA], self.physiology(phi)])

    def joined(self, theta: FloatArray, physiology: FloatArray, operator: FloatArray) -> FloatArray:
        """Join theta (n, 3), physiology (n, k) and operator (n, d - 3 - k), a first, to phi (n, d)."""
        return np.hstack([theta, operator[:, :1], physiology, operator[:, 1:]])


class BoxPrior(Protocol):
    """Anything with independent bounded log-Gaussian parameters: theta alone, or with others beside it."""

    @property
    def parameters(self) -> tuple[ParameterPrior, ...]:
        """The priors of the d parameters, in order."""

    def __hash__(self) -> int:
        """Equal priors have equal hashes, so that what follows from one can be kept."""


@dataclass(frozen=True)
class SomeParameters:
    """Parameters of a prior, by themselves."""

    parameters: tuple[ParameterPrior, ...]


def log_centre(prior: BoxPrior) -> FloatArray:
    """Return the parameters of shape (d,) on which the prior is log-centred."""
    return np.array([parameter.centre for parameter in prior.parameters])


def bounds(prior: BoxPrior) -> tuple[FloatArray, FloatArray]:
    """Return the hard bounds of the parameters, lower and upper, each of shape (d,)."""
    low = np.array([parameter.low for parameter in prior.parameters])
    high = np.array([parameter.high for parameter in prior.parameters])
    return low, high


@dataclass(frozen=True)
class _LogNormals:
    """The truncated normals of the d logarithms; every array of shape (d,)."""

    mean: FloatArray
    sd: FloatArray
    level_low: FloatArray
    mass: FloatArray
    log_norm: FloatArray


@lru_cache(maxsize=64)
def _log_normals(prior: BoxPrior) -> _LogNormals:
    """Return what the densities of the logarithms need; bounds enclose the centres, so no mass is tiny."""
    from scipy.special import ndtr

    mean, sd = np.log(log_centre(prior)), np.array([parameter.log_sd for parameter in prior.parameters])
    low, high = (ndtr((np.log(bound) - mean) / sd) for bound in bounds(prior))
    log_norm = np.log(high - low) + np.log(sd) + 0.5 * np.log(2.0 * np.pi)
    return _LogNormals(mean, sd, low, high - low, log_norm)


def quantile(u: FloatArray, prior: BoxPrior) -> FloatArray:
    """Map uniforms of shape (n, d) to parameters of shape (n, d) by the inverse distribution function."""
    from scipy.special import ndtri

    of = _log_normals(prior)
    return np.clip(np.exp(of.mean + of.sd * ndtri(of.level_low + u * of.mass)), *bounds(prior))


def level(theta: FloatArray, prior: BoxPrior) -> FloatArray:
    """Return the distribution function of parameters of shape (n, d), the inverse of :func:`quantile`."""
    from scipy.special import ndtr

    of = _log_normals(prior)
    return np.clip((ndtr((np.log(theta) - of.mean) / of.sd) - of.level_low) / of.mass, 0.0, 1.0)


def log_of_scores(scores: FloatArray, prior: BoxPrior) -> tuple[FloatArray, FloatArray]:
    """Return the logarithms of parameters of normal scores (n, d), under which the prior is N(0, I).

    They are log F^-1(Phi(scores)); their slopes along each score come with them, (n, d) each.
    """
    from scipy.special import ndtr, ndtri

    of = _log_normals(prior)
    z = ndtri(of.level_low + ndtr(scores) * of.mass)
    return of.mean + of.sd * z, np.asarray(of.sd * of.mass * np.exp(0.5 * (z**2 - scores**2)))


def sample(count: int, prior: BoxPrior, rng: np.random.Generator) -> FloatArray:
    """Draw parameters of shape (count, d)."""
    return quantile(rng.random((count, len(prior.parameters))), prior)


def draw_prior(prior: BoxPrior, draws: int, rng: np.random.Generator) -> FloatArray:
    """Draw parameters (draws, d), never onto the faces of the box, where the logit is infinite."""
    low, high = bounds(prior)
    return np.asarray(np.clip(sample(draws, prior, rng), np.nextafter(low, high), np.nextafter(high, low)))


@lru_cache(maxsize=4)
def even_quantiles(prior: BoxPrior) -> FloatArray:
    """Return the prior's quantiles at ``VARIANCE_POINTS`` even levels, a column each parameter."""
    u = (np.arange(VARIANCE_POINTS) + 0.5) / VARIANCE_POINTS
    return quantile(np.repeat(u[:, None], len(prior.parameters), axis=1), prior)


@lru_cache(maxsize=4)
def spread_points(prior: BoxPrior) -> FloatArray:
    """Return 2^16 parameters spread over the prior by a Sobol sequence; shape (65536, d)."""
    from scipy.stats import qmc

    points = qmc.Sobol(d=len(prior.parameters), scramble=False).random_base2(SOBOL_POWER)
    return quantile(points + 0.5 / 2**SOBOL_POWER, prior)


@lru_cache(maxsize=4)
def prior_variance(prior: BoxPrior) -> FloatArray:
    """Return the variance of each parameter under the prior, shape (d,), from its quantile function."""
    return np.asarray(even_quantiles(prior).var(axis=0))


def log_density(theta: FloatArray, prior: BoxPrior) -> FloatArray:
    """Return log p(theta) of shape (n,) for parameters of shape (n, d); -inf outside the bounds.

    The density is per unit of theta, so each parameter brings the Jacobian 1/theta of the logarithm.
    """
    of, inside = _log_normals(prior), in_bounds(theta, prior)
    log_theta = np.log(np.where(inside[:, None], theta, log_centre(prior)))
    terms = -0.5 * ((log_theta - of.mean) / of.sd) ** 2 - log_theta - of.log_norm
    return np.where(inside, terms.sum(axis=1), -np.inf)


def in_bounds(theta: FloatArray, prior: BoxPrior) -> BoolArray:
    """Tell for each row of shape (n, d) whether it lies within the prior's hard bounds."""
    low, high = bounds(prior)
    return np.asarray(np.all((theta >= low) & (theta <= high), axis=1))


def to_logit(phi: FloatArray, prior: BoxPrior) -> FloatArray:
    """Map phi (..., d) inside the prior's box to log((phi - low) / (high - phi)), unbounded."""
    low, high = bounds(prior)
    return np.asarray(np.log(phi - low) - np.log(high - phi))


def from_logit(eta: FloatArray, prior: BoxPrior) -> FloatArray:
    """Map any eta (..., d) into the prior's box, the inverse of :func:`to_logit`; never onto its faces."""
    from scipy.special import expit

    low, high = bounds(prior)
    phi = low + (high - low) * expit(eta)
    return np.asarray(np.clip(phi, np.nextafter(low, high), np.nextafter(high, low)))


def log_jacobian(eta: FloatArray, prior: BoxPrior) -> FloatArray:
    """Return log |d phi / d eta| of shape (...) for eta (..., d); p(eta) = p(phi) times it."""
    from scipy.special import log_expit

    low, high = bounds(prior)
    terms = log_expit(eta) + log_expit(-eta) + np.log(high - low)
    return np.asarray(terms.sum(axis=-1))
