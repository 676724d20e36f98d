"""Recovery of known parameters under one reading, at every checkpoint of training."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from studies.readings.chain import RECOVERY, Case, ChainSettings, Row, curves_of_cycles
from studies.readings.treatment import Features
from swesbi.base.arrays import FloatArray
from swesbi.checks.recovery import NothingRecoveredError, fresh_simulations, recover, score_recovery, shares
from swesbi.heart.prior_simulations import PriorSimulations
from swesbi.measurement.likelihood import MeasuredSubject
from swesbi.measurement.operator import active_stiffness_map, passive_shape, total_cycle
from swesbi.measurement.settings import summary_names
from swesbi.networks.paper.estimator import Checkpoint
from swesbi.networks.paper.maf import draw_candidates
from swesbi.networks.paper.pool import Pool, augment, noise_sd, with_context
from swesbi.parameters import THETA_NAMES
from swesbi.seeds import generator, integer_seed


def synthetic_recordings(
    cases: Sequence[Case], features: Features, chain: ChainSettings, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Return theta (N, 3) and raw features with context (N, C), shared over the subjects.

    Theta and noise are those of the study's recovery; where nothing is made otherwise, so are the features.
    """
    counts = shares(chain.recovery.recordings, len(cases))
    made = [_of_case(case, n, features, chain, seed) for case, n in zip(cases, counts, strict=True) if n]
    theta, raw = (np.concatenate(parts) for parts in zip(*made, strict=True))
    return theta, raw


def _of_case(
    case: Case, count: int, features: Features, chain: ChainSettings, seed: int
) -> tuple[FloatArray, FloatArray]:
    context = case.subject.observation.context
    simulations = fresh_simulations(count, context, chain.prior, chain.forward_model, seed)
    cycles = synthetic_cycles(case.subject, simulations, features, chain)
    curves = curves_of_cycles(case.subject, simulations.cycle_phase, cycles)
    observed = features.observed(curves, generator(seed, "recovery", "curve noise", context.subject))
    sd = noise_sd(summary_names(chain.summary), features.on_features)
    noisy = augment(observed, sd, 1, generator(seed, "recovery", "feature noise", context.subject))[:, 0]
    return simulations.theta, with_context(noisy, context)


def synthetic_cycles(
    subject: MeasuredSubject, simulations: PriorSimulations, features: Features, chain: ChainSettings
) -> FloatArray:
    """Return total stiffness (n, M) over the cycle: along the reading's beat, stretched after the peak."""
    active = (simulations.cycle_phase, simulations.active_stiffness_kpa)
    treatment = features.treatment
    total = total_cycle(active, subject.passive, subject.measurement)
    if treatment.recovery_passive == "own":
        shape = passive_shape(simulations.stretch, chain.passive.exponent_b)
        to_measured = active_stiffness_map(subject.measurement.active_stiffness_map)
        total = subject.passive.scale_kpa * shape + to_measured(simulations.active_stiffness_kpa)
    return stretched_after_peak(simulations.cycle_phase, total, treatment.recovery_stretch)


def stretched_after_peak(cycle_phase: FloatArray, cycles: FloatArray, fraction: float) -> FloatArray:
    """Return cycles (n, M) whose time after the largest value runs slower by a fraction.

    E(s) becomes E(p + (s - p) / (1 + fraction)) after the phase p of the largest value; what then lies
    beyond the end of the cycle is left out.
    """
    if fraction == 0.0:
        return cycles
    peaks = cycle_phase[np.argmax(cycles, axis=1)]
    after = np.maximum(cycle_phase - peaks[:, None], 0.0)
    at = cycle_phase - after * fraction / (1.0 + fraction)
    closed = np.append(cycle_phase, cycle_phase[0] + 1.0)
    around = np.concatenate([cycles, cycles[:, :1]], axis=1)
    splines = (CubicSpline(closed, cycle, bc_type="periodic") for cycle in around)
    return np.stack([spline(phase) for spline, phase in zip(splines, at, strict=True)])


def recovery_rows(
    pool: Pool,
    nets: Sequence[Checkpoint],
    truth: FloatArray,
    raw: FloatArray,
    chain: ChainSettings,
    seed: int,
) -> Iterator[Row]:
    """Yield the share of credible intervals that contain the truth, by parameter and network."""
    settings = chain.recovery.model_copy(update={"nominal_levels": (chain.predictive.interval,)})
    z, drawn_by = pool.standardisation.apply(raw), integer_seed(seed, "recovery", "posterior")
    for net in nets:
        candidates = draw_candidates(net, z, settings.candidate_draws, drawn_by)
        try:
            recovered = recover(truth, candidates, chain.prior, settings)
        except NothingRecoveredError:
            yield from (Row(RECOVERY, name, net.epoch, float("nan")) for name in THETA_NAMES)
            continue
        for scored in score_recovery(recovered, chain.prior, settings):
            yield Row(RECOVERY, scored.parameter, net.epoch, scored.coverage)
