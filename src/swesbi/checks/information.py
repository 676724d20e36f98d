"""Expected information of a recording about log phi, and the posterior that it lets one expect.

In log phi the prior is normal within its bounds, with precision Lambda = 1 / log_sd^2. About phi the
posterior of a recording with information I(phi) is then near normal with covariance (Lambda + I(phi))^-1
(Laplace's approximation with the expected for the observed information; Chaloner and Verdinelli, Stat Sci
10:273, 1995, Sec. 2). The bounds and the curvature beyond second order are left out.

Log speeds have means m and the covariance C = diag(se^2) + W W' + K o (delta^2 + tau^2 s s'), o by element:
their own errors, what sweeps share, and what the model misses, with slopes s, and K one within a cell of the
cycle, else zero. With Q = C^-1, D = diag(s) and R = K D Q,

    I_jk = m_j' Q m_k + 1/2 tr(Q C_j Q C_k) = m_j' Q m_k + tau^4 s_j' (R o R' + Q o (R D K)) s_k,

where an index is a derivative by log phi (Kay, Fundamentals of Statistical Signal Processing: Estimation
Theory, 1993, Eq. 3.31). The second term is what the spread of the data tells.

With the errors of so many times as many repeats, or pushes, the same expectation says what more of them would
buy. What the model misses is one a cell of the cycle and stays, however often one records.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.heart.simulate import Beats
from swesbi.measurement.derived import reported
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.measurement.speeds import SpeedRecording
from swesbi.prior import BoxPrior

TIMES: Final = (2.0, 4.0, 8.0)
"""Not without end: pushes of a cell without errors would tell what the model misses there."""


@dataclass(frozen=True)
class Stencil:
    """n phi with their neighbours for differences in log phi, simulated.

    ``log_phi`` (1 + 2 d, n, d) is phi itself, then moved forth and back by a step along each coordinate;
    ``beats`` are of its rows, one after the other.
    """

    log_phi: FloatArray
    beats: Beats
    step: float

    @property
    def rows(self) -> FloatArray:
        """All phi, one after the other; shape (n + 2 d n, d)."""
        return np.exp(self.log_phi).reshape(-1, self.log_phi.shape[-1])

    def derivatives(self, values: FloatArray) -> FloatArray:
        """Return d values / d log phi (n, d, p) from values at all rows (n + 2 d n, p)."""
        at = values.reshape(*self.log_phi.shape[:2], -1)
        return np.asarray(np.moveaxis((at[1::2] - at[2::2]) / (2.0 * self.step), 0, 1))


def simulated_stencil(model: SpeedModel, phi: FloatArray, step: float) -> Stencil:
    """Simulate phi (n, d) and their neighbours in log phi."""
    log_phi = np.repeat(np.log(phi)[None], 1 + 2 * phi.shape[1], axis=0)
    for coordinate in range(phi.shape[1]):
        log_phi[1 + 2 * coordinate, :, coordinate] += step
        log_phi[2 + 2 * coordinate, :, coordinate] -= step
    rows = np.exp(log_phi).reshape(-1, phi.shape[1])
    # neighbours of a point along what measures a heart have one beat, which is simulated once
    hearts = model.settings.prior.heart(rows)
    _, first, place = np.unique(hearts, axis=0, return_index=True, return_inverse=True)
    return Stencil(log_phi, model.simulate(rows[first]).rows(place.ravel()), step)


class SpeedDerivatives(NamedTuple):
    """Slopes of the log speeds of n phi at p phases, and how log speeds and slopes change with log phi.

    d log c / ds is (n, p), both derivatives by log phi are (n, d, p).
    """

    slope: FloatArray
    log_speed_by: FloatArray
    slope_by: FloatArray

    def points(self, kept: BoolArray) -> SpeedDerivatives:
        """Return those of some phases; ``kept`` of shape (p,)."""
        return SpeedDerivatives(*(part[..., kept] for part in self))


def speed_derivatives(model: SpeedModel, simulated: Stencil) -> SpeedDerivatives:
    """Return the derivatives at the phases of the recording; NaN where a neighbour has no beat."""
    predicted = model.predict_from(simulated.rows, simulated.beats)
    slope = predicted.slope[: simulated.log_phi.shape[1]]
    return SpeedDerivatives(
        slope, simulated.derivatives(predicted.log_speed), simulated.derivatives(predicted.slope)
    )


def expected_information(
    at: SpeedDerivatives, recording: SpeedRecording, discrepancy: DiscrepancySettings
) -> FloatArray:
    """Return the expected information about log phi of speeds with the errors of a recording; (n, d, d)."""
    cells, slope = recording.cells, at.slope
    together = np.equal.outer(cells, cells).astype(np.float64)
    missed = discrepancy.speed_fraction**2 + (
        discrepancy.timing_cycle**2 * slope[:, :, None] * slope[:, None, :]
    )
    whole = np.linalg.inv(recording.errors.covariance + together * missed)
    of_mean = at.log_speed_by @ whole @ np.swapaxes(at.log_speed_by, 1, 2)
    turned = together @ (slope[:, :, None] * whole)
    weight = turned * np.swapaxes(turned, 1, 2) + whole * ((turned * slope[:, None, :]) @ together)
    of_spread = at.slope_by @ weight @ np.swapaxes(at.slope_by, 1, 2)
    return np.asarray(of_mean + discrepancy.timing_cycle**4 * of_spread)


def prior_precision(prior: BoxPrior) -> FloatArray:
    """Return Lambda, (d, d)."""
    return np.diag(np.array([parameter.log_sd for parameter in prior.parameters]) ** -2.0)


def expected_sd(precision: FloatArray, information: FloatArray, gradient: FloatArray) -> FloatArray:
    """Return the expected posterior sd of log quantities, (..., q).

    The variance is averaged over the n draws: over those of a posterior, it is what this subject's next
    recording is expected to leave. The precision of the prior is (d, d), information (..., n, d, d), and d
    log quantity / d log phi (n, q, d).
    """
    covariance = np.linalg.inv(precision + information)
    variance = np.einsum("nqj,...njk,nqk->...nq", gradient, covariance, gradient)
    return np.asarray(np.sqrt(variance.mean(axis=-2)))


@dataclass(frozen=True)
class PhaseInformation:
    """What p phases tell of q quantities; (q, p) each.

    ``share`` is that of the phase in the expected information about the quantity, all else known; where
    phases share errors, in the sum of what each adds to the others. ``sd_increase`` is the fraction by which
    the expected posterior sd of the log grows without the phase.
    """

    share: FloatArray
    sd_increase: FloatArray


@dataclass(frozen=True)
class Expectation:
    """What posterior draws let one expect of recordings of their subject.

    ``at`` are derivatives at n draws, ``gradient`` is d log quantity / d log phi there, (n, q, d).
    """

    model: SpeedModel
    at: SpeedDerivatives
    gradient: FloatArray

    @classmethod
    def of(cls, model: SpeedModel, simulated: Stencil, gradient: FloatArray) -> Expectation:
        """Take those draws whose neighbours can all be simulated, of n with their gradients (n, q, d)."""
        at = speed_derivatives(model, simulated)
        parts = (at.log_speed_by, at.slope_by, gradient)
        works = np.all([np.isfinite(part).all(axis=(1, 2)) for part in parts], axis=0)
        return cls(model, SpeedDerivatives(*(part[works] for part in at)), gradient[works])

    def sd(self, recording: SpeedRecording) -> FloatArray:
        """Return the expected posterior sd of the log quantities, (q,), with the errors of a recording."""
        information = expected_information(self.at, recording, self.model.settings.discrepancy)
        return expected_sd(prior_precision(self.model.settings.prior), information, self.gradient)

    def by_phase(self) -> PhaseInformation:
        """Compare the information with and without each phase of the recording.

        The share of a phase in the information about a quantity with gradient g is that along the direction
        g / |g|^2, in which the log quantity rises by its own amount.
        """
        recording, discrepancy = self.model.recording, self.model.settings.discrepancy
        total = expected_information(self.at, recording, discrepancy)
        others = ~np.eye(len(recording.phase), dtype=bool)
        without = np.stack(
            [
                expected_information(self.at.points(kept), recording.points(kept), discrepancy)
                for kept in others
            ]
        )
        precision = prior_precision(self.model.settings.prior)
        whole = expected_sd(precision, total, self.gradient)
        direction = self.gradient / np.sum(self.gradient**2, axis=2, keepdims=True)
        along = np.einsum("nqj,pnjk,nqk->qp", direction, total - without, direction)
        return PhaseInformation(
            share=along / along.sum(axis=1, keepdims=True),
            sd_increase=(expected_sd(precision, without, self.gradient) / whole).T - 1.0,
        )


@dataclass(frozen=True)
class MoreRepeats:
    """Expected widths (t, q) of intervals with so many ``times`` (t,) as many repeats.

    A width is the expected posterior sd of the log of a quantity over that of the recording as it is.
    """

    times: tuple[float, ...]
    width: FloatArray


def more_repeats(model: SpeedModel, phi: FloatArray, step: float) -> MoreRepeats | None:
    """Return what more repeats would buy of all that an answer reports, by posterior draws (n, d).

    None where no draw's neighbours can all be simulated.
    """
    simulated = simulated_stencil(model, phi, step)
    expected = Expectation.of(model, simulated, reported_gradient(model, simulated))
    return repeats_of(expected) if len(expected.gradient) else None


def repeats_of(expected: Expectation) -> MoreRepeats:
    """Return what more repeats would buy of the quantities of an expectation."""
    recording = expected.model.recording
    widths = [expected.sd(repeated(recording, times)) for times in TIMES]
    return MoreRepeats(TIMES, np.stack(widths) / expected.sd(recording))


def repeated(recording: SpeedRecording, times: float) -> SpeedRecording:
    """Return a recording with the errors of so many times as many repeats."""
    part = times**-0.5
    return replace(recording, relative_se=part * recording.relative_se, shared=part * recording.shared)


def reported_gradient(model: SpeedModel, simulated: Stencil) -> FloatArray:
    """Return d log quantity / d log phi of all that an answer reports, at n phi; shape (n, q, d)."""
    quantities = reported(model, simulated.rows, simulated.beats)
    log_quantity = np.log(np.stack(list(quantities.values()), axis=-1))
    return np.asarray(np.swapaxes(simulated.derivatives(log_quantity), 1, 2))
