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
from pydantic.config import JsonDict

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
)

VARIANCE_POINTS: Final = 100_000
SOBOL_POWER: Final = 16
Positive = Annotated[float, Field(gt=0.0)]
OF_ITS_KEY: Final[JsonDict] = {"unit": "of its key"}


class ParameterPrior(Settings):
    """Bounded log-Gaussian prior of one parameter; centre and bounds in the parameter's unit."""

    centre: Positive = Field(description="Exp of the mean of log theta.", json_schema_extra=OF_ITS_KEY)
    log_sd: Positive = Field(description="Standard deviation of log theta.")
    low: Positive = Field(description="Hard lower bound.", json_schema_extra=OF_ITS_KEY)
    high: Positive = Field(description="Hard upper bound.", json_schema_extra=OF_ITS_KEY)

    @model_validator(mode="after")
    def _check_bounds(self) -> Self:
        if not self.low < self.centre < self.high:
            raise ValueError(f"need low < centre < high, found {self.low} / {self.centre} / {self.high}")
        return self


class NuisanceSettings(Settings):
    """Priors of nuisance parameters; one that has none is fixed at the value of the forward model's settings.

    R_d and the time constant R_d C_s are independent, so that R_d and C_s are negatively correlated; the
    duration is that at the reference period, which a subject's heart rate scales.

    Recordings tell little of them; they are drawn with every simulation. Centres are those of
    `forward_model`, or round values about them. Widths are what is known of healthy adults, or a
    judgement that says so. Bounds lie at three standard deviations for `length_dependence`,
    `passive_ratio` and `passive_middle_factor`, and at about four for the others. Deleting a line fixes the
    parameter: ratios, factors and scales at 1, others at `forward_model`.
    """

    activation_onset_s: ParameterPrior | None = Field(
        default=None,
        description="Onset of activation after the R peak. The pre-ejection period has a standard "
        "deviation of 13 ms at a given heart rate (Weissler et al., Circulation 1968;37:149).",
    )
    activation_duration_s: ParameterPrior | None = Field(
        default=None,
        description="Duration of activation at the reference period. At 75 beats a minute the second "
        "heart sound follows the R peak by 350 ms, with a standard deviation of 14 ms between persons "
        "(Weissler et al., Circulation 1968;37:149). How much of that is the duration is not known: from "
        "0.26 to 0.42 s at two standard deviations (chosen). The duration follows heart rate by the "
        "square root of the period, as in `forward_model`.",
    )
    activation_ramp_s: ParameterPrior | None = Field(
        default=None,
        description="Width of the ramps of activation. Calcium in human myocytes rises from 10 to 90 % "
        "within 15 to 60 ms, by preparation and temperature. The wall is activated one part after another "
        "besides. From 10 to 100 ms at two standard deviations (chosen).",
    )
    destruction_alpha: ParameterPrior | None = Field(
        default=None,
        description="Bonds destroyed per unit of strain. There is no measurement; a factor of two either "
        "way at two standard deviations (chosen).",
    )
    sigma_0_pa: ParameterPrior | None = Field(
        default=None,
        description="Stress of the fully activated fibre. Strips of failing hearts develop half the "
        "stress of healthy ones (Hasenfuss et al., Circ Res 1992;70:1225), whole hearts 70 % "
        "(Efstratiadis and Michaels, J Card Fail 2008;14:577). A factor of 1.8 either way at two standard "
        "deviations, so that failing hearts lie within (chosen).",
    )
    passive_wall_factor: ParameterPrior | None = Field(
        default=None,
        description="Factor of the passive moduli of the wall. Moduli of healthy hearts differ by a "
        "quarter and more between persons (fits to MRI: Genet et al., J Appl Physiol 2014;117:142). With "
        "patients they differ by a factor of four (Bortone et al., J Am Coll Cardiol 1989;14:613). A wall "
        "a third as stiff as in `forward_model` is PhysioBlocks' (chosen to hold all of these).",
    )
    distal_resistance_pa_s_m3: ParameterPrior | None = Field(
        default=None,
        description="Systemic vascular resistance. The reference range, 700 to 1600 dyn s/cm5, spans four "
        "standard deviations of the log.",
    )
    arterial_time_constant_s: ParameterPrior | None = Field(
        default=None,
        description="Time constant R_d C_s of the arterial decay. Stroke volume over pulse pressure "
        "varies by a quarter (de Simone et al., J Am Coll Cardiol 1999;33:800). Resistance explains a "
        "part of that. R_d and C_s are thereby negatively correlated (-0.7).",
    )
    stressed_volume_factor: ParameterPrior | None = Field(
        default=None,
        description="Factor of the stressed volume, by which the heart is filled. Blood volume of persons "
        "of one size varies by a tenth (Feldschuh and Enson, Circulation 1977;56:605). Its stressed share "
        "and the filling pressure vary more: wedge pressures reach 13 mmHg in the healthy (Zeder et al., "
        "Eur Respir J 2024;64:2400967) and 22 in patients (Bortone et al. 1989). A factor of 1.6 either "
        "way at two standard deviations (chosen).",
    )
    length_dependence: ParameterPrior | None = Field(
        default=None,
        description="Share of the length dependence of the bonds that PhysioBlocks' human heart has. None, "
        "at 0, is the paper's. What septa have in vivo is not known (chosen: from nearly none to all).",
    )
    atrial_kick_pa: ParameterPrior | None = Field(
        default=None,
        description="Rise of the atrial pressure by atrial contraction. Healthy left atria reach 10.4 "
        "mmHg in the a wave, over a mean of 7.9 (Braunwald et al., Circulation 1961;24:267). Some hardly "
        "contract, others raise it by 15 mmHg (chosen). The source lies behind the pulmonary capacitance, "
        "so that the atrium shows about seven tenths of it.",
    )
    atrial_delay_s: ParameterPrior | None = Field(
        default=None,
        description="Start of atrial contraction, from 0.26 s before the R peak. The mitral annulus moves "
        "54 ms after the P wave begins (Akamatsu et al., Cardiovasc Ultrasound 2020), and PR is about 160 "
        "ms. At the centre it lasts from 0.13 s before the R peak to 0.01 s after it (chosen).",
    )
    passive_ratio: ParameterPrior | None = Field(
        default=None,
        description="Passive stiffness at the smallest stretch of the beat, over that at the largest. "
        "Stretched myocardium stiffens, which gives ratios below 1. Below its resting length it resists too "
        "(restoring force of titin: Helmes et al., Circ Res 1996;79:619), which gives ratios above 1. "
        "Neither is likelier beforehand. Chosen on hearts of development (studies/validation). Bounds lie at "
        "three standard deviations.",
    )
    passive_middle_factor: ParameterPrior | None = Field(
        default=None,
        description="Passive stiffness at the middle stretch, over the geometric mean of both ends. At 1 its "
        "logarithm is linear in stretch. Chosen on hearts of development (studies/validation). Bounds lie at "
        "three standard deviations.",
    )
    speed_scale: ParameterPrior | None = Field(
        default=None,
        description="Scale of all speeds of a recording. Plate thickness, fibre angle and dispersion make "
        "it. Systems differ by about 5 % on the same phantoms (RSNA/QIBA: Hall et al., IEEE Int Ultrason "
        "Symp 2013; Palmeri et al., J Ultrasound Med 2021;40:569).",
    )

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
