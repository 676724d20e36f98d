"""What an answer says of a heart beside what is true of it: intervals, the verdict, the sampler."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from studies.validation.hearts.heart import K_SR, OtherHeart
from swesbi import artefacts
from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.context import Context
from swesbi.draws import interval_levels, median_and_interval
from swesbi.measurement.derived import curve_quantities, derived, half_active_ms
from swesbi.measurement.likelihood import SpeedModel
from swesbi.parameters import HALF_ACTIVE, ISOMETRIC, PEAK_ACTIVE, THETA_NAMES
from swesbi.report.tables.validation import QUANTITIES, SCORED
from swesbi.verdict.summary import REFUSED
from swesbi.verdict.verdict import Status

UNITS: Final = "kPa, s-1, ms, kPa, s-1, ms, kPa, kPa, kPa, s-1"


@dataclass(frozen=True)
class HeartAnswer:
    """The answer to one heart, in the order of ``QUANTITIES``; NaN where it has no such thing."""

    number: Annotated[int, artefacts.Variable("", "1", "number of the heart")]
    context: Annotated[Context, artefacts.Part()]
    redrawn: Annotated[int, artefacts.Variable("", "1", "hearts and recordings that failed before it")]
    status: Annotated[str, artefacts.Variable("", "1", "not contradicted, doubtful, contradicted or refused")]
    reason: Annotated[str, artefacts.Variable("", "1", "the tests that speak against the model")]
    by_mcmc: Annotated[bool, artefacts.Variable("", "1", "1 where MCMC gave the draws")]
    converged: Annotated[bool, artefacts.Variable("", "1", "1 where weights or sampler are reliable")]
    efficiency: Annotated[float, artefacts.Variable("", "1", "effective share of the weighted draws")]
    truth: Annotated[FloatArray, artefacts.Variable("quantity", UNITS, "true value")]
    low: Annotated[FloatArray, artefacts.Variable("quantity", UNITS, "lower end of the credible interval")]
    median: Annotated[FloatArray, artefacts.Variable("quantity", UNITS, "posterior median")]
    high: Annotated[FloatArray, artefacts.Variable("quantity", UNITS, "upper end of the credible interval")]
    width_log_scale_fixed: Annotated[
        FloatArray, artefacts.Variable("quantity", "1", "log high / low, the scale of the speeds fixed at 1")
    ]

    @property
    def not_contradicted(self) -> bool:
        """Whether a reader is told that the model can have made the recording."""
        return self.status != REFUSED and Status(self.status).fits

    @property
    def asked(self) -> BoolArray:
        """Which quantities have a truth and an interval; shape (q,)."""
        return np.asarray(np.isfinite(self.truth) & np.isfinite(self.median))

    @property
    def covered(self) -> BoolArray:
        """Which of them lie in their interval; False where there is none; shape (q,)."""
        return np.asarray(self.asked & (self.truth >= self.low) & (self.truth <= self.high))

    @property
    def missed(self) -> bool:
        """Whether peak active stiffness, or k_SR where there is one, lies outside its interval."""
        return bool((self.asked & ~self.covered)[:SCORED].any())


@dataclass(frozen=True)
class Intervals:
    """Limits and medians of the scored quantities, and widths at a fixed scale of the speeds; (q,) each."""

    low: FloatArray
    median: FloatArray
    high: FloatArray
    width_log_scale_fixed: FloatArray


def truths(heart: OtherHeart) -> FloatArray:
    """Return the true value of each scored quantity, NaN where the heart has none; shape (q,)."""
    theta = np.full(len(THETA_NAMES), np.nan) if heart.theta is None else heart.theta
    k_sr = np.nan if heart.k_sr_per_s is None else heart.k_sr_per_s
    phase, stiffness = heart.curve.cycle_phase, heart.curve.stiffness_kpa[None]
    curve = curve_quantities(phase, stiffness, heart.context.period_s)
    known = {name: float(values[0]) for name, values in curve.items()}
    known |= dict(zip(THETA_NAMES, theta, strict=True)) | {THETA_NAMES[K_SR]: k_sr}
    isometric = np.nan if heart.isometric_kpa is None else heart.isometric_kpa
    half_ms = half_active_ms(phase, heart.active_kpa[None], heart.context.period_s)[0]
    known |= {PEAK_ACTIVE.name: heart.peak_active_kpa, HALF_ACTIVE.name: float(half_ms), ISOMETRIC: isometric}
    return np.array([known[name] for name in QUANTITIES])


def intervals(model: SpeedModel, phi: FloatArray, mass: float) -> Intervals:
    """Return equal-tailed intervals of the scored quantities, from posterior draws phi (m, d)."""
    found = derived(model, phi, model.simulate(phi)) | dict(zip(THETA_NAMES, phi.T, strict=False))
    values = np.column_stack([found[name] for name in QUANTITIES])
    works = np.isfinite(values).all(axis=1)
    if not works.any():
        raise ValueError("no draw of the posterior has a periodic beat, so nothing is known of its curve")
    widths = width_at_fixed_scale(values[works], model.speed_scale(phi)[works], mass)
    return Intervals(*median_and_interval(values[works], mass), widths)


def width_at_fixed_scale(values: FloatArray, speed_scale: FloatArray, mass: float) -> FloatArray:
    """Return log high / low of each quantity, were the scale q of the speeds known to be 1; shape (k,).

    The interval is that of the residuals of log quantity after linear regression on log q, over the draws:
    positive quantities (m, k) and their q (m,). Exact where the posterior of both logarithms is normal, since
    the width of a conditional normal distribution does not depend on the value of q that is given; else an
    approximation.
    """
    log_values, log_q = np.log(values), np.log(speed_scale)
    centred = (log_q - log_q.mean())[:, None]
    slope = np.linalg.lstsq(centred, log_values - log_values.mean(axis=0), rcond=None)[0]
    low, high = np.quantile(log_values - centred @ slope, interval_levels(mass), axis=0)
    return np.asarray(high - low)


def refusal(number: int, heart: OtherHeart, redrawn: int, reason: str) -> HeartAnswer:
    """Return the answer to a heart that the network does not answer for."""
    nothing = Intervals(*np.full((4, len(QUANTITIES)), np.nan))
    return HeartAnswer(
        number, heart.context, redrawn, REFUSED, reason, by_mcmc=False, converged=False,
        efficiency=np.nan, truth=truths(heart), **vars(nothing),
    )  # fmt: skip
