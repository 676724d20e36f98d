"""The speeds of a recording as normal data, in the logit of the prior's box or in log phi."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.forward_model.beats import Beats
from swesbi.identifiability.maximise import Maxima, NormalProblem, maximise
from swesbi.identifiability.normal import MomentFunction, Moments, central_difference, stencil
from swesbi.parameters import PHI_NAMES, SCALE
from swesbi.prior import from_logit, sample, to_logit
from swesbi.seeds import generator
from swesbi.speed_model.likelihood import log_speed_sd
from swesbi.speed_model.model import SpeedModel

FloatArray = NDArray[np.float64]

LOGIT_REACH: Final = 8.0
"""The search's box in logit: within 0.03 % of the prior's box at either bound."""


def moments_of_phi(model: SpeedModel, phi: FloatArray) -> Moments:
    """Return mean and log sd of the measured log speeds at phi (n, 4)."""
    predicted = model.predict(phi)
    sd = log_speed_sd(predicted, model.recording.relative_se, model.settings.discrepancy)
    return Moments(predicted.log_speed, np.log(sd))


def in_logit(model: SpeedModel, step: float) -> NormalProblem:
    """Return the exact likelihood in eta = logit of the prior's box, ready to be maximised."""

    def moments(eta: FloatArray) -> Moments:
        return moments_of_phi(model, from_logit(eta, model.settings.prior))

    reach = np.full(len(PHI_NAMES), LOGIT_REACH)
    return NormalProblem(moments, np.log(model.recording.speed_m_s), -reach, reach, step)


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
    return maximise(problem, eta[likeliest], range(len(PHI_NAMES)))


@dataclass(frozen=True)
class SimulatedStencil:
    """n phi with their neighbours for differences in log phi, simulated once for any set of phases.

    Attributes:
        log_phi: (1 + 2 * 4, n, 4).
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
        log_speed_by: d log c / d log phi_j; (n, 4, p).
        slope_by: Derivative of the slope likewise; (n, 4, p).
    """

    phase: FloatArray
    slope: FloatArray
    log_speed_by: FloatArray
    slope_by: FloatArray

    def at(self, which: NDArray[np.int64]) -> SpeedDerivatives:
        """Return the derivatives at some of the phases."""
        return SpeedDerivatives(
            self.phase[which],
            self.slope[..., which],
            self.log_speed_by[..., which],
            self.slope_by[..., which],
        )


def simulate_stencil(model: SpeedModel, phi: FloatArray, step: float) -> SimulatedStencil:
    """Simulate phi (n, 4) and their neighbours in log phi."""
    log_phi = stencil(np.log(phi), step, range(len(PHI_NAMES)))
    return SimulatedStencil(log_phi, model.simulate(np.exp(log_phi).reshape(-1, len(PHI_NAMES))), step)


def derivatives_at(model: SpeedModel, simulated: SimulatedStencil, phase: FloatArray) -> SpeedDerivatives:
    """Return the derivatives at phases (p,) that the subject's recording need not have."""
    elsewhere = replace(model, recording=replace(model.recording, phase=phase))
    predicted = elsewhere.predict_from(np.exp(simulated.log_phi[..., SCALE]).ravel(), simulated.beats)
    shape = (*simulated.log_phi.shape[:2], len(phase))
    log_speed, slope = predicted.log_speed.reshape(shape), predicted.slope.reshape(shape)
    return SpeedDerivatives(
        phase,
        slope[0],
        central_difference(log_speed, simulated.step),
        central_difference(slope, simulated.step),
    )
