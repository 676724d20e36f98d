"""Predictive checks of an experiment on features: curves, and the paper's noise put back on them.

The paper's Eq. 5 adds Gaussian noise to five features of a curve and to no value of the curve itself, so it
says of no phase how far a new recording may lie from the simulated curve. A predictive interval under the
observation model asks for that, and so for a reading of what each noise does to the whole curve:

``maximum_kpa``
    A scale of the whole curve, baseline included: E -> E (1 + epsilon / max E). The maximum then moves by
    epsilon, as in Eq. 5, and every phase in proportion, which is what one error of the speed's scale does
    to E = 3 rho c^2. Eq. 5 gives baseline and minimum no noise of their own.
``time_to_peak_cycle``
    A shift of the whole curve along the cycle, around its end: E(s) -> E(s - epsilon). The peak then moves by
    epsilon, as in Eq. 5. A scale leaves the phase of the peak, and a shift leaves its height, so that
    both features have the noise of Eq. 5 and no more.
``auc_kpa``, ``post_peak_auc_kpa``, ``decay_slope_kpa_per_cycle``
    Nothing more. They stay as Eq. 5 defines them, noise added to the feature of a drawn curve
    (:func:`replicates`): an area or a slope belongs to infinitely many curves, and no one deformation of a
    curve to it. Scale and shift move them already. Under 1 kPa and 0.03 of the cycle the area of the six
    volunteers' prior curves moves by 0.4 kPa (Eq. 5: 0.5), that after the peak by 0.3 kPa (0.5) and the decay
    slope from the peak to the end by 3 to 5 kPa per cycle (5): a third move for each would count that noise
    twice.

The trajectory values, which Eq. 5 does "not independently" perturb, so move with the curve that they are of.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Final

import numpy as np

from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.checks.predictive import (
    CheckedFeatures,
    Draws,
    PredictiveCheck,
    Replicates,
    Target,
    log_scores,
    predict,
)
from swesbi.checks.settings import PredictiveSettings
from swesbi.heart.model import activation_duration_s, isometric_stiffness_kpa
from swesbi.heart.periodic import Status
from swesbi.heart.prior_simulations import PriorSimulations
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import Beats, simulate
from swesbi.measurement.likelihood import MeasuredSubject
from swesbi.measurement.operator import PassiveBaseline
from swesbi.measurement.settings import MeasurementSettings, SummarySettings, summary_names
from swesbi.networks.paper.pool import noise_sd
from swesbi.networks.settings import ObservationModelSettings
from swesbi.posterior.truncated import Posterior
from swesbi.recording.observation import Observation
from swesbi.seeds import generator
from swesbi.verdict.verdict import Verdict

SCALED_BY: Final = "maximum_kpa"
SHIFTED_BY: Final = "time_to_peak_cycle"


def _draws(
    subject: MeasuredSubject,
    forward_model: ForwardModelSettings,
    features: CheckedFeatures,
    theta: FloatArray,
    simulated: PriorSimulations | Beats,
    chosen: slice | BoolArray,
    failed: int = 0,
) -> Draws:
    """Return theta (n, 3) with the curves of its simulations, those ``chosen``, as predictive draws."""
    cycles = (simulated.cycle_phase, simulated.active_stiffness_kpa[chosen])
    grid = subject.on_grid(*cycles)
    duration_s = activation_duration_s(subject.observation.context.period_s, forward_model)
    return Draws(
        theta,
        curve_kpa=grid,
        phase_kpa=subject.at_phases(*cycles),
        features=features.of(grid),
        end_diastolic_volume_ml=simulated.end_diastolic_volume_ml[chosen],
        end_systolic_volume_ml=simulated.end_systolic_volume_ml[chosen],
        isometric_stiffness_kpa=isometric_stiffness_kpa(theta, duration_s),
        failed=failed,
    )


def observed_curves(
    curves_kpa: FloatArray,
    feature_noise_sd: Mapping[str, float],
    rng: np.random.Generator,
) -> FloatArray:
    """Return each curve (n, G) as one new observation would show it: scaled, and shifted along the cycle.

    The last value of a curve equals its first. One scale and one shift a curve are drawn, in this order.
    """
    raised, shift = rng.standard_normal((2, len(curves_kpa)))
    scaled = scale_peaks(curves_kpa, feature_noise_sd.get(SCALED_BY, 0.0) * raised)
    return shift_cycles(scaled, feature_noise_sd.get(SHIFTED_BY, 0.0) * shift)


def scale_peaks(curves_kpa: FloatArray, raised_kpa: FloatArray) -> FloatArray:
    """Scale curves (n, G), which are positive, so that their maxima rise by ``raised_kpa`` (n,)."""
    factor = raised_kpa[:, None] / curves_kpa.max(axis=1, keepdims=True)
    return np.asarray(curves_kpa + factor * curves_kpa)


def shift_cycles(curves_kpa: FloatArray, shift_cycle: FloatArray) -> FloatArray:
    """Move curves (n, G) later by ``shift_cycle`` (n,), around the cycle: E(s - shift).

    Between points of the grid the curve is linear; a shift by whole steps moves values as they are.
    """
    steps = curves_kpa.shape[1] - 1
    return _read(curves_kpa, np.arange(steps + 1) - steps * shift_cycle[:, None])


def at_phases(curves_kpa: FloatArray, phase: FloatArray) -> FloatArray:
    """Return curves (n, G) of the analysis grid at phases (p,), linearly between its points; shape (n, p)."""
    return _read(
        curves_kpa, np.broadcast_to((curves_kpa.shape[1] - 1) * phase, (len(curves_kpa), len(phase)))
    )


def _read(curves: FloatArray, position: FloatArray) -> FloatArray:
    """Read each curve at its own positions (n, p), counted in steps of the grid around the cycle."""
    steps, rows = curves.shape[1] - 1, np.arange(len(curves))[:, None]
    start = np.floor(position)
    before = start.astype(np.int64) % steps
    fraction = position - start
    return np.asarray((1.0 - fraction) * curves[rows, before] + fraction * curves[rows, before + 1])


def replicates(
    draws: Draws, target: Target, feature_noise_sd: Mapping[str, float], seed: int, subject: str, of: str
) -> Replicates:
    """Return draws as new observations under the observation model (paper, Eq. 5) show them.

    Two noises move whole curves (:func:`observed_curves`); what they do at a phase of the
    recording is read off the grid, and added to the draw's value there. Features have theirs by Eq. 5. The
    noise of the measurement alone is Gaussian, of the recording's standard errors. ``of`` is "prior" or
    "posterior", and names the streams of the noise.
    """
    of_curves = generator(seed, "observed curves", subject, of)
    rng = generator(seed, "predictive", subject, of)
    curves = observed_curves(draws.curve_kpa, feature_noise_sd, of_curves)
    features = draws.features + rng.standard_normal(draws.features.shape) * target.feature_noise_sd
    measured_kpa = np.full(draws.phase_kpa.shape, np.nan)
    shown = draws.phase_kpa[:, target.measured]
    noise = rng.standard_normal(shown.shape) * target.stiffness_se_kpa[target.measured]
    measured_kpa[:, target.measured] = shown + noise
    return Replicates(
        draws,
        curve_kpa=curves,
        phase_kpa=draws.phase_kpa + at_phases(curves - draws.curve_kpa, target.phase),
        features=features,
        measured_kpa=measured_kpa,
    )


def check_of_features(
    posterior: Posterior,
    verdict: Verdict,
    observation: Observation,
    passive: PassiveBaseline,
    shards: PriorSimulations,
    *,
    predictive: PredictiveSettings,
    forward_model: ForwardModelSettings,
    measurement: MeasurementSettings,
    summary: SummarySettings,
    observation_model: ObservationModelSettings,
    seed: int,
) -> PredictiveCheck:
    """Check the predictions of one subject; a subject outside the prior's support has no posterior.

    The noise that the observation model puts back on curves has a stream of its own.
    """
    features = CheckedFeatures(predictive.features, summary)
    subject = MeasuredSubject(observation, passive, measurement)
    noise = observation_model.feature_noise_sd
    sd = noise_sd(summary_names(summary), noise)
    target = features.target(observation, observation.stiffness_se_kpa, sd[features.columns])
    draws_of = partial(_draws, subject, forward_model, features)
    before = draws_of(shards.theta[: predictive.draws], shards, slice(predictive.draws))
    if verdict.may_be_read:
        theta = posterior.theta[: predictive.draws]
        beats = simulate(theta, observation.context, forward_model)
        good = beats.status == Status.PERIODIC
        after = draws_of(theta[good], beats, good, failed=int((~good).sum()))
    else:
        after = draws_of(shards.theta[:0], shards, slice(0))
    prior, found = (
        predict(
            replicates(draws, target, noise, seed, observation.subject, of),
            target,
            predictive.interval,
            of_new=False,
        )
        for of, draws in (("prior", before), ("posterior", after))
    )
    check = PredictiveCheck(target, predictive.interval, verdict.may_be_read, prior, found)
    log_scores(observation.subject, check)
    return check
