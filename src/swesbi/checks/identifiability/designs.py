"""What other recordings would tell: more repeats, other phases, and phases chosen for a cohort.

The likelihood of a recording takes the model's errors to be independent from phase to phase. Recordings
with phases closer together than the shipped ones would average such errors away, which real model errors,
being continuous over the cycle, do not allow. Here their correlation falls linearly to zero over a given
distance (a tent, positive definite on the circle), so that both agree where phases are further apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from swesbi.artefacts import Variable
from swesbi.base.arrays import FloatArray, IntArray
from swesbi.checks.identifiability.information import (
    SimulatedStencil,
    SpeedDerivatives,
    derivatives_at,
    expected_variance,
    log_gradient,
    prior_precision,
)
from swesbi.checks.identifiability.noise import NO_NOISE, MeanNoise
from swesbi.checks.identifiability.settings import DesignSettings
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.parameters import THETA_NAMES


def uniform_phases(count: int, offset: float = 0.5) -> FloatArray:
    """Return ``count`` evenly spaced phases; the first lies at ``offset`` of their distance."""
    return (np.arange(count) + offset) / count


def correlation(phase: FloatArray, range_cycle: float) -> FloatArray:
    """Return the correlation (..., p, p) of model errors at phases (..., p), around the cycle."""
    distance = np.abs(phase[..., :, None] - phase[..., None, :])
    # the end of a cycle is the beginning of the next
    around = np.minimum(distance, 1.0 - distance)
    return np.asarray(np.maximum(1.0 - around / range_cycle, 0.0))


def design_information(
    at: SpeedDerivatives,
    noises: Sequence[MeanNoise],
    discrepancy: DiscrepancySettings,
    error_correlation: FloatArray,
) -> FloatArray:
    """Return the expected information about log phi of speeds at the phases of ``at``, by noise.

    For log speeds ~ N(m, C) with C = se^2 1 + u^2 J + K (delta^2 + tau^2 s s'), s the slopes, K the
    correlation of model errors, and J all ones for what sweeps share, of variance u^2,
    I_jk = m_j' C^-1 m_k + 1/2 tr(C^-1 C_j C^-1 C_k), where an index is a derivative (Kay, Fundamentals of
    Statistical Signal Processing: Estimation Theory, 1993, Eq. 3.31).
    In the eigenvectors of C without its first term, the matrix is diagonal whatever se.

    Args:
        at: Derivatives at the phases; (..., p) and (..., d, p).
        noises: Noise of the mean speeds; r levels.
        discrepancy: delta and tau.
        error_correlation: K, (..., p, p).

    Returns:
        Information; (r, ..., d, d).
    """
    timing, slope = discrepancy.timing_cycle**2, at.slope
    model_error = discrepancy.speed_fraction**2 + timing * slope[..., :, None] * slope[..., None, :]
    change = _change(at, timing, error_correlation) if timing else None
    # own noise, equal at all phases, leaves the eigenvectors as they are: one decomposition serves its levels
    turned = {
        shared: _turned(error_correlation * model_error + shared, at.log_speed_by, change)
        for shared in dict.fromkeys(noise.shared for noise in noises)
    }
    levels = [(noise.own, *turned[noise.shared]) for noise in noises]
    return np.stack(
        [_in_eigenvectors(mean, by, 1.0 / (np.maximum(value, 0.0) + own)) for own, value, mean, by in levels]
    )


def _change(at: SpeedDerivatives, timing: float, error_correlation: FloatArray) -> FloatArray:
    """Return C_j (..., d, p, p): with the parameters changes what an error in phase does to a speed."""
    half = at.slope_by[..., :, None] * at.slope[..., None, None, :]
    return np.asarray(timing * error_correlation[..., None, :, :] * (half + np.swapaxes(half, -1, -2)))


def _turned(
    matrix: FloatArray, mean_by: FloatArray, change: FloatArray | None
) -> tuple[FloatArray, FloatArray, FloatArray | None]:
    """Return eigenvalues (..., p) of a matrix, m_j in its eigenvectors, and C_j if there is any."""
    value, vector = np.linalg.eigh(matrix)
    if change is None:
        return value, mean_by @ vector, None
    turned = vector[..., None, :, :]
    return value, mean_by @ vector, np.swapaxes(turned, -1, -2) @ change @ turned


def _in_eigenvectors(mean_by: FloatArray, change: FloatArray | None, weight: FloatArray) -> FloatArray:
    """Return I for weights (..., p) = 1 / eigenvalues of C, with m_j (..., d, p) and C_j (..., d, p, p)."""
    root = np.sqrt(weight)
    mean_by = mean_by * root[..., None, :]
    of_mean = np.asarray(mean_by @ np.swapaxes(mean_by, -1, -2))
    if change is None:
        return of_mean
    change = change * (root[..., :, None] * root[..., None, :])[..., None, :, :]
    flat = change.reshape(*change.shape[:-2], -1)
    return np.asarray(of_mean + 0.5 * flat @ np.swapaxes(flat, -1, -2))


def choose_phases(
    candidates: Sequence[SpeedDerivatives],
    noises: Sequence[MeanNoise],
    discrepancy: DiscrepancySettings,
    range_cycle: float,
    precision: FloatArray,
    wanted: Sequence[int],
    count: int,
) -> IntArray:
    """Choose phases one after the other, each the best addition to those before, for all subjects at once.

    The best is that with the least sum, over subjects and wanted parameters, of the log of the expected
    posterior variance: gains count by their ratio, in whatever parameter or subject.

    Args:
        candidates: Each subject's derivatives at the same candidate phases.
        noises: Of each subject's mean speeds.
        discrepancy: delta and tau.
        range_cycle: Distance over which model errors are correlated.
        precision: Of the prior; (d, d).
        wanted: Indices of the parameters that the recording is made for.
        count: How many phases to choose.

    Returns:
        Indices of the chosen candidates, in the order of choice; (count,).
    """
    # one after the other: the sets of n phases among the candidates are too many to be tried
    chosen: list[int] = []
    for _ in range(count):
        left = np.setdiff1d(np.arange(len(candidates[0].phase)), chosen)
        sets = np.column_stack([np.tile(chosen, (len(left), 1)).astype(np.int64), left])
        cost = sum(
            _cost(one, sets, noise, discrepancy, range_cycle, precision, wanted)
            for one, noise in zip(candidates, noises, strict=True)
        )
        chosen.append(int(left[np.argmin(cost)]))
    return np.array(chosen)


def _cost(
    candidates: SpeedDerivatives,
    sets: IntArray,
    noise: MeanNoise,
    discrepancy: DiscrepancySettings,
    range_cycle: float,
    precision: FloatArray,
    wanted: Sequence[int],
) -> FloatArray:
    """Return the sum of log expected variances for sets (m, p) of phases, shape (m,)."""
    parts = (candidates.slope, candidates.log_speed_by, candidates.slope_by)
    slope, log_speed_by, slope_by = (np.moveaxis(part[..., sets], -2, 0) for part in parts)
    at = SpeedDerivatives(candidates.phase[sets], slope, log_speed_by, slope_by)
    error_correlation = correlation(at.phase, range_cycle)[:, None]
    information = design_information(at, [noise], discrepancy, error_correlation)[0]
    gradient = np.broadcast_to(
        np.eye(len(precision))[list(wanted)], (slope.shape[1], len(wanted), len(precision))
    )
    variance = expected_variance(precision, information, gradient).mean(axis=-2)
    return np.asarray(np.log(variance).sum(axis=-1))


@dataclass(frozen=True)
class Designs:
    """Expected posterior sd of the log of q quantities, for N numbers of phases and R of repeats.

    Without any noise, the model's errors alone are left.
    """

    sd_log: Annotated[
        FloatArray,
        Variable(
            "quantity phases repeats", "1", "expected sd of the log; model errors of near phases correlated"
        ),
    ]
    sd_log_independent: Annotated[
        FloatArray, Variable("quantity phases repeats", "1", "the same with independent model errors")
    ]
    floor: Annotated[FloatArray, Variable("quantity phases", "1", "sd of the log without any noise")]
    floor_independent: Annotated[
        FloatArray, Variable("quantity phases", "1", "the same with independent model errors")
    ]


@dataclass(frozen=True)
class Placement:
    """Phases chosen for the whole cohort, and what they give beside even ones of the same number.

    The first n phases are the choice of n; ``counts`` are the numbers of phases compared.
    """

    phase: Annotated[FloatArray, Variable("choice", "1", "phases chosen, best first", group="placement")]
    counts: tuple[int, ...]
    sd_log: Annotated[
        FloatArray,
        Variable(
            "subject quantity placed", "1", "expected sd of the log with the first so many", group="placement"
        ),
    ]
    sd_log_even: Annotated[
        FloatArray, Variable("subject quantity placed", "1", "with as many, evenly spaced", group="placement")
    ]


def expected_of_designs(
    model: SpeedModel,
    simulated: SimulatedStencil,
    repeat: MeanNoise,
    settings: DesignSettings,
) -> Designs:
    """Judge evenly spaced designs for one subject.

    Args:
        model: Its recording's model.
        simulated: Posterior draws with their neighbours.
        repeat: Noise of one repeat's mean speed.
        settings: The designs.
    """
    noises = [*(repeat.of(repeats) for repeats in settings.repeats), NO_NOISE]
    correlated, independent = (
        np.stack(
            [_even(model, simulated, noises, count, settings, reach) for count in settings.phases],
            axis=1,
        )
        for reach in (settings.discrepancy_range_cycle, None)
    )
    return Designs(correlated[..., :-1], independent[..., :-1], correlated[..., -1], independent[..., -1])


def place_phases(
    models: Sequence[SpeedModel],
    simulated: Sequence[SimulatedStencil],
    noises: Sequence[MeanNoise],
    settings: DesignSettings,
) -> Placement:
    """Choose phases for a cohort, at its own repeats, for the three active parameters together.

    Args:
        models: One a subject.
        simulated: Posterior draws with their neighbours.
        noises: Noise of each subject's mean speeds.
        settings: Candidates, and how many to choose.
    """
    candidates = uniform_phases(settings.placement_candidates)
    at = [
        derivatives_at(model, stencil, candidates) for model, stencil in zip(models, simulated, strict=True)
    ]
    discrepancy, prior = models[0].settings.discrepancy, models[0].settings.prior
    chosen = candidates[
        choose_phases(
            at,
            noises,
            discrepancy,
            settings.discrepancy_range_cycle,
            prior_precision(prior),
            range(len(THETA_NAMES)),
            settings.placement_phases,
        )
    ]
    counts = tuple(count for count in settings.phases if count <= settings.placement_phases)
    parts = list(zip(models, simulated, noises, strict=True))
    reach = settings.discrepancy_range_cycle
    chosen_sd = [
        np.stack([_sd(model, stencil, [noise], [chosen[:n]], reach)[:, 0] for n in counts], axis=1)
        for model, stencil, noise in parts
    ]
    even = [
        np.stack([_even(model, stencil, [noise], n, settings, reach)[:, 0] for n in counts], axis=1)
        for model, stencil, noise in parts
    ]
    return Placement(chosen, counts, np.stack(chosen_sd), np.stack(even))


def _even(
    model: SpeedModel,
    simulated: SimulatedStencil,
    noises: Sequence[MeanNoise],
    count: int,
    settings: DesignSettings,
    reach: float | None,
) -> FloatArray:
    """Return the expected sd (q, noise levels) of evenly spaced phases, whatever the first one's place."""
    # a protocol sets the distance of the phases, hardly where the first one falls: averaged over its places
    offsets = uniform_phases(settings.offsets)
    sets = [uniform_phases(count, offset) for offset in offsets]
    return _sd(model, simulated, noises, sets, reach)


def _sd(
    model: SpeedModel,
    simulated: SimulatedStencil,
    noises: Sequence[MeanNoise],
    sets: Sequence[FloatArray],
    reach: float | None,
) -> FloatArray:
    """Return the root of the expected variance (q, noise levels), averaged over sets of phases and draws.

    Without a reach, model errors are independent.
    """
    gradient = log_gradient(model, np.exp(simulated.log_phi[0]))
    precision = prior_precision(model.settings.prior)
    expected = []
    for phase in sets:
        together = np.eye(len(phase)) if reach is None else correlation(phase, reach)
        at = derivatives_at(model, simulated, phase)
        information = design_information(at, noises, model.settings.discrepancy, together[None])
        expected.append(expected_variance(precision, information, gradient))
    return np.asarray(np.sqrt(np.mean(expected, axis=(0, 2))).T)
