"""What a recording tells of which quantity: contraction, expected information, and which phases carry it.

In log phi the prior is normal within its bounds, with precision 1 / log_sd^2. About phi the posterior of
a recording with information I(phi) is then near normal with covariance (Lambda + I(phi))^-1 (Laplace's
approximation with the expected for the observed information; Chaloner and Verdinelli, Stat Sci 10:273,
1995, Sec. 2). The bounds and the curvature beyond second order are left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np
from scipy.special import ndtri

from swesbi.artefacts import Variable
from swesbi.base.arrays import FloatArray, IntArray
from swesbi.checks.identifiability.likelihood import (
    Maxima,
    MomentFunction,
    Moments,
    NormalProblem,
    central_difference,
    maximise,
    stencil,
)
from swesbi.heart.model import isometric_stiffness_kpa
from swesbi.heart.simulate import Beats
from swesbi.measurement.likelihood import SpeedModel, log_speed_sd
from swesbi.parameters import ISOMETRIC, K_0, K_ATP, OF_INTEREST, PHI_NAMES
from swesbi.posterior.diagnostics import smooth
from swesbi.prior import BoxPrior, from_logit, sample, spread_points, to_logit
from swesbi.seeds import generator

QUANTITY_NAMES: Final = (*PHI_NAMES, ISOMETRIC)
LOGIT_REACH: Final = 8.0
"""The search's box in logit: within 0.03 % of the prior's box at either bound."""


def quantities(model: SpeedModel, phi: FloatArray) -> FloatArray:
    """Return the reported part of phi (n, d) and k_0 (1 - exp(-k_ATP D_T)); shape (n, 5)."""
    return np.column_stack(
        [phi[:, OF_INTEREST], isometric_stiffness_kpa(phi, model.activation_duration_s(phi))]
    )


def log_gradient(model: SpeedModel, phi: FloatArray) -> FloatArray:
    """Return d log quantity / d log phi of phi (n, d), shape (n, 5, d).

    With u = k_ATP D_T, log(1 - exp(-u)) changes by u / (exp(u) - 1) for each unit of log k_ATP, and of log D.
    """
    names = model.settings.prior.names
    gradient = np.zeros((len(phi), len(QUANTITY_NAMES), len(names)))
    gradient[:, : len(PHI_NAMES), : len(PHI_NAMES)] = np.eye(len(PHI_NAMES))
    exponent = phi[:, K_ATP] * model.activation_duration_s(phi)
    gradient[:, -1, K_0] = 1.0
    gradient[:, -1, K_ATP] = exponent / np.expm1(exponent)
    if "activation_duration_s" in names:
        gradient[:, -1, names.index("activation_duration_s")] = gradient[:, -1, K_ATP]
    return gradient


@dataclass(frozen=True)
class Contraction:
    """1 - posterior variance / prior variance of q quantities, themselves and their logarithms; (q,) each.

    One: the recording tells the quantity exactly. Zero: it tells nothing. Negative: the posterior is wider
    than the prior, which happens for a value far out in a skewed prior.
    """

    linear: Annotated[
        FloatArray, Variable("quantity", "1", "1 - posterior variance / prior variance", "contraction")
    ]
    logarithm: Annotated[FloatArray, Variable("quantity", "1", "the same of the log", "contraction_log")]


def contraction(draws: FloatArray, prior_draws: FloatArray) -> Contraction:
    """Compare posterior draws (n, q) of positive quantities with prior draws (m, q)."""
    return Contraction(
        1.0 - draws.var(axis=0) / prior_draws.var(axis=0),
        1.0 - np.log(draws).var(axis=0) / np.log(prior_draws).var(axis=0),
    )


def prior_quantities(model: SpeedModel) -> FloatArray:
    """Return the quantities of 2^16 points spread over the prior by a Sobol sequence, (65536, 5)."""
    return quantities(model, spread_points(model.settings.prior))


def prior_precision(prior: BoxPrior) -> FloatArray:
    """Return Lambda, (d, d)."""
    return np.diag(np.array([parameter.log_sd for parameter in prior.parameters]) ** -2.0)


def expected_variance(precision: FloatArray, information: FloatArray, gradient: FloatArray) -> FloatArray:
    """Return the variances of log quantities, (..., n, q), from I (..., n, d, d) and d log q (n, q, d)."""
    covariance = np.linalg.inv(precision + information)
    return np.asarray(np.einsum("nqj,...njk,nqk->...nq", gradient, covariance, gradient))


def expected_sd(precision: FloatArray, information: FloatArray, gradient: FloatArray) -> FloatArray:
    """Return the root of the variance averaged over the n draws, (..., q).

    The mean over draws from the posterior is what this subject's next recording is expected to leave.
    """
    return np.asarray(np.sqrt(expected_variance(precision, information, gradient).mean(axis=-2)))


def interval_fold(sd_log: FloatArray, mass: float) -> FloatArray:
    """Return upper over lower end of the credible interval of a log-normal quantity."""
    return np.asarray(np.exp(2.0 * ndtri(0.5 + 0.5 * mass) * sd_log))


def moments_of_phi(model: SpeedModel, phi: FloatArray) -> Moments:
    """Return mean and log sd of the measured log speeds at phi (n, d)."""
    first, place = distinct_hearts(model, phi)
    predicted = model.predict_at(phi, model.wall(phi[first]).rows(place))
    sd = log_speed_sd(predicted, model.recording.relative_se, model.settings.discrepancy)
    return Moments(predicted.log_speed, np.log(sd), model.recording.shared)


def distinct_hearts(model: SpeedModel, phi: FloatArray) -> tuple[IntArray, IntArray]:
    """Return rows of phi (n, d) that hold each heart once, and which of them each row has; (h,) and (n,).

    Neighbours of a point along what measures a heart have one beat, which is simulated once.
    """
    hearts = model.settings.prior.heart(phi)
    _, first, place = np.unique(hearts, axis=0, return_index=True, return_inverse=True)
    return first, place.ravel()


def in_logit(model: SpeedModel, step: float) -> NormalProblem:
    """Return the exact likelihood in eta = logit of the prior's box, ready to be maximised.

    What is known of a nuisance parameter before the recording counts as a datum: the log of its prior's
    centre, with the prior's log sd. Without it no recording could hold them.
    """
    prior = model.settings.prior
    known = prior.parameters[OF_INTEREST.stop :]
    log_sd = np.log([parameter.log_sd for parameter in known])

    def moments(eta: FloatArray) -> Moments:
        phi = from_logit(eta, prior)
        of_speeds, nuisances = moments_of_phi(model, phi), np.log(phi[:, OF_INTEREST.stop :])
        spread = np.broadcast_to(log_sd, nuisances.shape)
        return Moments(
            np.hstack([of_speeds.mean, nuisances]),
            np.hstack([of_speeds.log_sd, spread]),
            np.pad(of_speeds.shared, ((0, len(known)), (0, 0))),
        )

    reach = np.full(len(prior.names), LOGIT_REACH)
    observed = np.log([*model.recording.speed_m_s, *(parameter.centre for parameter in known)])
    return NormalProblem(moments, observed, -reach, reach, step)


def in_log(model: SpeedModel) -> MomentFunction:
    """Return the moments as a function of log phi."""
    return lambda log_phi: moments_of_phi(model, np.exp(log_phi))


def maximum_likelihood(
    model: SpeedModel, problem: NormalProblem, prior_starts: int, searches: int, seed: int
) -> Maxima:
    """Search the maximum in logit from the likeliest of ``prior_starts`` draws from the prior."""
    rng = generator(seed, "identifiability", "starts", model.recording.subject)
    phi = sample(prior_starts, model.settings.prior, rng)
    eta = np.clip(to_logit(phi, model.settings.prior), problem.low, problem.high)
    likeliest = np.argsort(-problem.log_likelihood(eta), kind="stable")[:searches]
    return maximise(problem, eta[likeliest], range(eta.shape[1]))


@dataclass(frozen=True)
class SimulatedStencil:
    """n phi with their neighbours for differences in log phi, simulated once for any set of phases.

    Attributes:
        log_phi: (1 + 2 d, n, d).
        beats: Of its rows, one after the other.
        step: Of the differences.
    """

    log_phi: FloatArray
    beats: Beats
    step: float


@dataclass(frozen=True)
class SpeedDerivatives:
    """Log speeds' slopes, and how log speeds and slopes change with log phi, at p phases for n phi.

    Attributes:
        phase: (p,).
        slope: d log c / ds; (n, p).
        log_speed_by: d log c / d log phi_j; (n, d, p).
        slope_by: Derivative of the slope likewise; (n, d, p).
    """

    phase: FloatArray
    slope: FloatArray
    log_speed_by: FloatArray
    slope_by: FloatArray


def simulate_stencil(model: SpeedModel, phi: FloatArray, step: float) -> SimulatedStencil:
    """Simulate phi (n, d) and their neighbours in log phi."""
    log_phi = stencil(np.log(phi), step, range(phi.shape[1]))
    flat = np.exp(log_phi).reshape(-1, phi.shape[1])
    first, place = distinct_hearts(model, flat)
    return SimulatedStencil(log_phi, model.simulate(flat[first]).rows(place), step)


def derivatives_at(model: SpeedModel, simulated: SimulatedStencil, phase: FloatArray) -> SpeedDerivatives:
    """Return the derivatives at phases (p,) that the subject's recording need not have."""
    elsewhere = replace(model, recording=replace(model.recording, phase=phase))
    flat = np.exp(simulated.log_phi).reshape(-1, simulated.log_phi.shape[-1])
    predicted = elsewhere.predict_from(flat, simulated.beats)
    shape = (*simulated.log_phi.shape[:2], len(phase))
    log_speed, slope = predicted.log_speed.reshape(shape), predicted.slope.reshape(shape)
    return SpeedDerivatives(
        phase,
        slope[0],
        central_difference(log_speed, simulated.step),
        central_difference(slope, simulated.step),
    )


@dataclass(frozen=True)
class PhaseInformation:
    """What p phases tell of q quantities; (q, p) each.

    Attributes:
        share: Share of the phase in the expected information about the quantity, all else known; where
            phases share errors, in the sum of what each adds to the others.
        sd_increase: By what fraction the expected posterior sd of the log grows without the phase.
    """

    share: FloatArray
    sd_increase: FloatArray


@dataclass(frozen=True)
class LeftOut:
    """The posterior of log quantities without one phase, by reweighting the draws; p phases.

    Attributes:
        sd_increase: Relative change of the posterior sd; (q, p).
        mean_shift: Change of the posterior mean, in posterior sd; (q, p).
        k_hat: Pareto k of the weights, which are trustworthy below 0.7; (p,).
    """

    sd_increase: FloatArray
    mean_shift: FloatArray
    k_hat: FloatArray


def phase_information(
    total: FloatArray, by_phase: FloatArray, precision: FloatArray, gradient: FloatArray
) -> PhaseInformation:
    """Compare the information with and without each phase.

    Args:
        total: Expected information of all phases in log phi, at n draws; (n, d, d).
        by_phase: What each phase adds to the others; (n, p, d, d).
        precision: Of the prior; (d, d).
        gradient: d log quantity / d log phi; (n, q, d).

    The share of a phase in the information about a quantity with gradient g is that along the direction
    g / |g|^2, in which the log quantity rises by its own amount.
    """
    without = np.moveaxis(total[:, None] - by_phase, 1, 0)
    whole = expected_sd(precision, total, gradient)
    direction = gradient / np.sum(gradient**2, axis=2, keepdims=True)
    along = np.einsum("nqj,npjk,nqk->nqp", direction, by_phase, direction).mean(axis=0)
    return PhaseInformation(
        share=along / along.sum(axis=1, keepdims=True),
        sd_increase=(expected_sd(precision, without, gradient) / whole).T - 1.0,
    )


def leave_phases_out(log_quantities: FloatArray, log_likelihood_by_phase: FloatArray) -> LeftOut:
    """Reweight posterior draws by 1 / p(y_i | the other data, phi), which is the posterior without datum i.

    Gelfand, Dey and Chang (Bayesian Statistics 4, 1992); the weights are Pareto-smoothed (Vehtari,
    Gelman and Gabry, Stat Comput 27:1413, 2017).

    Args:
        log_quantities: Posterior draws of log quantities; (n, q).
        log_likelihood_by_phase: log p(y_i | the other data, phi) at the draws; (n, p).
    """
    log_weight, k_hat = zip(*map(smooth, -log_likelihood_by_phase.T), strict=True)
    weight = np.exp(log_weight)
    weight /= weight.sum(axis=1, keepdims=True)
    mean, sd = log_quantities.mean(axis=0), log_quantities.std(axis=0)
    mean_without = weight @ log_quantities
    spread = log_quantities[None] - mean_without[:, None]
    sd_without = np.sqrt(np.einsum("pn,pnq->pq", weight, spread**2))
    return LeftOut((sd_without / sd).T - 1.0, ((mean_without - mean) / sd).T, np.array(k_hat))
