"""The bounded log-Gaussian priors of theta and of phi, and the map of their box onto the whole space.

Parameters are independent. Inside its bounds, the logarithm of each is normal around log(centre) with the
given standard deviation; outside, the density is zero (paper, Sec. 2.4). The density is normalised over the
box, which the logit maps onto R^d. Every function takes a prior of theta as it takes one of phi = (theta, a).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Final, Protocol, Self

import numpy as np
from pydantic import Field, model_validator

from swesbi.arrays import BoolArray, FloatArray
from swesbi.base import Settings
from swesbi.parameters import SCALE, THETA_NAMES

VARIANCE_POINTS: Final = 100_000
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


class PriorSettings(Settings):
    """The prior of theta = (k_0, k_ATP, k_SR)."""

    k0_kpa: ParameterPrior
    k_atp_per_s: ParameterPrior
    k_sr_per_s: ParameterPrior

    @property
    def parameters(self) -> tuple[ParameterPrior, ...]:
        """The priors in the order of ``THETA_NAMES``."""
        return tuple(getattr(self, name) for name in THETA_NAMES)


class JointPriorSettings(Settings):
    """Bounded log-Gaussian priors of theta and of the passive scale a, independent."""

    theta: PriorSettings
    passive_scale_kpa: ParameterPrior = Field(description="prior of the passive scale a, in kPa")

    @property
    def parameters(self) -> tuple[ParameterPrior, ...]:
        """The four priors in the order of ``PHI_NAMES``."""
        return (*self.theta.parameters, self.passive_scale_kpa)


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


def quantile(u: FloatArray, prior: BoxPrior) -> FloatArray:
    """Map uniforms of shape (n, d) to parameters of shape (n, d) by the inverse distribution function."""
    from scipy.stats import truncnorm  # half a second, which stages that only name a prior need not wait

    columns = [
        np.exp(truncnorm.ppf(u[:, j], *_log_shape(parameter))) for j, parameter in enumerate(prior.parameters)
    ]
    theta: FloatArray = np.clip(np.stack(columns, axis=1), *bounds(prior))
    return theta


def sample(count: int, prior: BoxPrior, rng: np.random.Generator) -> FloatArray:
    """Draw parameters of shape (count, d)."""
    return quantile(rng.random((count, len(prior.parameters))), prior)


def draw_prior(prior: BoxPrior, draws: int, rng: np.random.Generator) -> FloatArray:
    """Draw parameters (draws, d), never onto the faces of the box, where the logit is infinite."""
    low, high = bounds(prior)
    return np.asarray(np.clip(sample(draws, prior, rng), np.nextafter(low, high), np.nextafter(high, low)))


def draw_passive_scale(count: int, prior: JointPriorSettings, rng: np.random.Generator) -> FloatArray:
    """Draw the passive scale alone; shape (count,), in kPa."""
    u = np.full((count, len(prior.parameters)), 0.5)
    u[:, SCALE] = rng.random(count)
    return quantile(u, prior)[:, SCALE]


@lru_cache(maxsize=4)
def even_quantiles(prior: BoxPrior) -> FloatArray:
    """Return the prior's quantiles at ``VARIANCE_POINTS`` even levels, a column each parameter."""
    u = (np.arange(VARIANCE_POINTS) + 0.5) / VARIANCE_POINTS
    return quantile(np.repeat(u[:, None], len(prior.parameters), axis=1), prior)


def prior_variance(prior: BoxPrior) -> FloatArray:
    """Return the variance of each parameter under the prior, shape (d,), from its quantile function."""
    return np.asarray(even_quantiles(prior).var(axis=0))


def log_density(theta: FloatArray, prior: BoxPrior) -> FloatArray:
    """Return log p(theta) of shape (n,) for parameters of shape (n, d); -inf outside the bounds.

    The density is per unit of theta, so each parameter brings the Jacobian 1/theta of the logarithm.
    """
    from scipy.stats import truncnorm

    inside = in_bounds(theta, prior)
    log_theta = np.log(np.where(inside[:, None], theta, log_centre(prior)))
    terms = [
        truncnorm.logpdf(log_theta[:, j], *_log_shape(parameter)) - log_theta[:, j]
        for j, parameter in enumerate(prior.parameters)
    ]
    return np.where(inside, np.sum(terms, axis=0), -np.inf)


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


def _log_shape(parameter: ParameterPrior) -> tuple[float, float, float, float]:
    """Return log theta's bounds in standard deviations, its mean and its standard deviation."""
    mean, sd = float(np.log(parameter.centre)), parameter.log_sd
    lower, upper = (np.log([parameter.low, parameter.high]) - mean) / sd
    return float(lower), float(upper), mean, sd
