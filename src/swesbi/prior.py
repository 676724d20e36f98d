"""The bounded log-Gaussian priors of theta and of phi, and the map of their box onto the whole space.

Parameters are independent. Inside its bounds, the logarithm of each is normal around log(centre) with the
given standard deviation; outside, the density is zero (paper, Sec. 2.4). The density is normalised over the
box, which the logit maps onto R^d. Every function takes a prior of theta as it takes one of phi.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Final, Protocol, Self

import numpy as np
from pydantic import Field, model_validator

from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.base.settings import Settings
from swesbi.parameters import NUISANCES, OPERATOR_NAMES, PHI_NAMES, PHYSIOLOGY_NAMES, THETA_NAMES

VARIANCE_POINTS: Final = 100_000
SOBOL_POWER: Final = 16
Positive = Annotated[float, Field(gt=0.0)]


class ParameterPrior(Settings):
    """Bounded log-Gaussian prior of one parameter; centre and bounds in the parameter's unit."""

    centre: Positive = Field(description="exp of the mean of log theta")
    log_sd: Positive = Field(description="standard deviation of log theta")
    low: Positive = Field(description="hard lower bound")
    high: Positive = Field(description="hard upper bound")

    @model_validator(mode="after")
    def _check_bounds(self) -> Self:
        if not self.low < self.centre < self.high:
            raise ValueError(f"need low < centre < high, found {self.low} / {self.centre} / {self.high}")
        return self


class NuisanceSettings(Settings):
    """Priors of nuisance parameters; one that has none is fixed at the value of the forward model's settings.

    R_d and the time constant R_d C_s are independent, so that R_d and C_s are negatively correlated; the
    duration is that at the reference period, which a subject's heart rate scales.
    """

    activation_onset_s: ParameterPrior | None = None
    activation_duration_s: ParameterPrior | None = None
    activation_ramp_s: ParameterPrior | None = None
    destruction_alpha: ParameterPrior | None = None
    sigma_0_pa: ParameterPrior | None = None
    passive_wall_factor: ParameterPrior | None = None
    distal_resistance_pa_s_m3: ParameterPrior | None = None
    arterial_time_constant_s: ParameterPrior | None = None
    stressed_volume_factor: ParameterPrior | None = None
    exponent_b: ParameterPrior | None = None
    passive_compression_factor: ParameterPrior | None = None
    speed_scale: ParameterPrior | None = None

    def freed(self, names: Iterable[str]) -> dict[str, ParameterPrior]:
        """Return the priors of those of these names that have one, in the order of the names."""
        return {name: prior for name in names if (prior := getattr(self, name)) is not None}

    @model_validator(mode="after")
    def _check_ranges(self) -> Self:
        for parameter in NUISANCES:
            prior, (low, high) = getattr(self, parameter.name), parameter.declared
            if prior is not None and (prior.low < low or prior.high > high):
                raise ValueError(
                    f"{parameter.name}: bounds {prior.low:g} to {prior.high:g} leave [{low:g}, {high:g}], "
                    "the range of the forward model; check the unit"
                )
        return self


class PriorSettings(Settings):
    """The prior of theta = (k_0, k_ATP, k_SR), and of the nuisance parameters that are free beside it."""

    k0_kpa: ParameterPrior
    k_atp_per_s: ParameterPrior
    k_sr_per_s: ParameterPrior
    nuisances: NuisanceSettings = Field(
        default=NuisanceSettings(), description="nuisance parameters that are free, each by its prior"
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


class OperatorPrior(Settings):
    """What the measurement takes: the passive scale, and the free parameters of the measurement."""

    scale: ParameterPrior
    nuisances: NuisanceSettings

    @property
    def parameters(self) -> tuple[ParameterPrior, ...]:
        """The prior of the passive scale, then of the others."""
        return (self.scale, *self.nuisances.freed(OPERATOR_NAMES).values())


class JointPriorSettings(Settings):
    """Bounded log-Gaussian priors of phi = (theta, a, nuisances), independent; d parameters."""

    theta: PriorSettings
    passive_scale_kpa: ParameterPrior = Field(description="prior of the passive scale a, in kPa")

    @property
    def parameters(self) -> tuple[ParameterPrior, ...]:
        """The priors in the order of ``names``."""
        return (*self.theta.parameters, self.passive_scale_kpa, *self._nuisances.values())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the d parameters: theta, a, and the nuisance parameters that are free."""
        return (*PHI_NAMES, *self._nuisances)

    @property
    def nuisance_names(self) -> tuple[str, ...]:
        """Names of the d - 4 nuisance parameters that are free beside the passive scale."""
        return tuple(self._nuisances)

    @property
    def operator(self) -> OperatorPrior:
        """The prior of what the measurement takes."""
        return OperatorPrior(scale=self.passive_scale_kpa, nuisances=self.theta.nuisances)

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

    def joined(self, theta: FloatArray, physiology: FloatArray, operator: FloatArray) -> FloatArray:
        """Join theta (n, 3), physiology (n, k) and operator (n, d - 3 - k), scale first, to phi (n, d)."""
        return np.hstack([theta, operator[:, :1], physiology, operator[:, 1:]])


class BoxPrior(Protocol):
    """Anything with independent bounded log-Gaussian parameters: theta alone, or with others beside it."""

    @property
    def parameters(self) -> tuple[ParameterPrior, ...]:
        """The priors of the d parameters, in order."""

    def __hash__(self) -> int:
        """Equal priors have equal hashes, so that what follows from one can be kept."""


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
    inside: BoolArray = np.all((theta >= low) & (theta <= high), axis=1)
    return inside


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
