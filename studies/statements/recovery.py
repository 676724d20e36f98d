"""Recordings with known parameters, as a reading makes and standardises them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.base.settings import Settings
from swesbi.checks.recovery import fresh_simulations, shares, synthetic_recordings
from swesbi.checks.settings import PredictiveSettings, RecoverySettings
from swesbi.heart.prior_simulations import PriorSimulations
from swesbi.heart.settings import ForwardModelSettings
from swesbi.measurement.likelihood import MeasuredSubject
from swesbi.measurement.operator import active_stiffness_map, passive_shape
from swesbi.measurement.settings import MeasurementSettings, SummarySettings, summary_names
from swesbi.measurement.summary import summarise
from swesbi.networks.files import Standardisation, fit_standardisation
from swesbi.networks.paper.pool import Pool, augment, noise_sd, with_context
from swesbi.networks.settings import ObservationModelSettings
from swesbi.posterior.settings import PosteriorSettings
from swesbi.prior import PriorSettings
from swesbi.recording.phases import sample_cycle, to_grid
from swesbi.seeds import generator
from swesbi.verdict.settings import SupportSettings


class ExperimentSettings(Settings):
    """What posterior, predictive check and recovery of an experiment depend on."""

    prior: PriorSettings
    forward_model: ForwardModelSettings
    measurement: MeasurementSettings
    summary: SummarySettings
    observation_model: ObservationModelSettings
    support: SupportSettings
    posterior: PosteriorSettings
    predictive: PredictiveSettings
    recovery: RecoverySettings


def known_recordings(
    subjects: Sequence[MeasuredSubject],
    pool: Pool,
    own: ExperimentSettings,
    how: str,
    exponent_b: float,
    seed: int,
) -> tuple[FloatArray, FloatArray]:
    """Return theta (N, 3) and conditioning vectors (N, C), as the study has them or otherwise.

    Subjects share them evenly, each in its context; the pool standardises them. ``how`` is as
    ``Reading.recovery`` says.
    """
    if how == "own_beat":
        truth, raw = _along_own_beats(subjects, own, exponent_b, seed)
    else:
        truth, raw = synthetic_recordings(
            subjects,
            own.recovery.recordings,
            prior=own.prior,
            forward_model=own.forward_model,
            summary=own.summary,
            observation_model=own.observation_model,
            seed=seed,
        )
    return truth, _scale(raw, pool, own).apply(
        raw
    ) if how == "own_statistics" else pool.standardisation.apply(raw)


def _scale(raw: FloatArray, pool: Pool, own: ExperimentSettings) -> Standardisation:
    """Return mean and sd of these recordings' features; contexts keep those of training."""
    features, known = len(summary_names(own.summary)), pool.standardisation
    of_these = fit_standardisation(raw)
    return Standardisation(
        mean=np.append(of_these.mean[:features], known.mean[features:]),
        scale=np.append(of_these.scale[:features], known.scale[features:]),
    )


def _along_own_beats(
    subjects: Sequence[MeasuredSubject], own: ExperimentSettings, exponent_b: float, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Return theta and raw vectors of recordings whose passive stiffness runs along their own stretch."""
    counts = shares(own.recovery.recordings, len(subjects))
    parts = [
        _of_subject(subject, count, own, exponent_b, seed)
        for subject, count in zip(subjects, counts, strict=True)
        if count
    ]
    truth, raw = (np.concatenate(part) for part in zip(*parts, strict=True))
    return truth, raw


def _of_subject(
    subject: MeasuredSubject, count: int, own: ExperimentSettings, exponent_b: float, seed: int
) -> tuple[FloatArray, FloatArray]:
    context = subject.observation.context
    simulations = fresh_simulations(count, context, own.prior, own.forward_model, seed)
    features = summarise(_curves(subject, simulations, exponent_b), own.summary)
    sd = noise_sd(summary_names(own.summary), own.observation_model.feature_noise_sd)
    noisy = augment(features, sd, 1, generator(seed, "recovery", "feature noise", context.subject))[:, 0]
    return simulations.theta, with_context(noisy, context)


def _curves(subject: MeasuredSubject, simulations: PriorSimulations, exponent_b: float) -> FloatArray:
    """Return curves (n, G) as the recording's phases show them."""
    to_measured = active_stiffness_map(subject.measurement.active_stiffness_map)
    passive = subject.passive.scale_kpa * passive_shape(simulations.stretch, exponent_b)
    total = passive + to_measured(simulations.active_stiffness_kpa)
    phase = subject.observation.measured_phase
    return to_grid(
        phase, sample_cycle(simulations.cycle_phase, total, phase), subject.measurement.grid_points
    )
