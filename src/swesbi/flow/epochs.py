"""The rows of one epoch: the same theta, a fresh passive scale, noise and discrepancy for each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.flow.conditioning import Conditioner, ConditioningSettings, fit_conditioner, raw_features
from swesbi.flow.simulations import SubjectSimulations, noisy_speeds
from swesbi.inference.standardisation import Standardisation, fit_standardisation
from swesbi.prior import to_logit
from swesbi.seeds import generator

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Rows:
    """Training rows of all subjects: eta = logit(phi) of shape (N, 4), and z of shape (N, C)."""

    eta: FloatArray
    z: FloatArray


@dataclass(frozen=True)
class _Raw:
    eta: FloatArray
    features: FloatArray


def split_by_theta(
    subjects: Sequence[SubjectSimulations], validation_fraction: float
) -> tuple[list[SubjectSimulations], list[SubjectSimulations]]:
    """Split each subject's simulations into training and held-out theta, the last ones held out.

    Draws from the prior come in no order, so the last are as good as any; no theta is on both sides.

    Raises:
        ValueError: A side would be empty.
    """
    counts = [len(part.theta) for part in subjects]
    edges = [n - round(validation_fraction * n) for n in counts]
    if any(not 0 < edge < n for edge, n in zip(edges, counts, strict=True)):
        raise ValueError(
            f"{min(counts)} simulations cannot be split with validation_fraction = {validation_fraction}; "
            "simulate more or change the fraction"
        )
    training = [part.rows(0, edge) for part, edge in zip(subjects, edges, strict=True)]
    held_out = [part.rows(edge, n) for part, edge, n in zip(subjects, edges, counts, strict=True)]
    return training, held_out


def fit_statistics(
    subjects: Sequence[SubjectSimulations], settings: ConditioningSettings, seed: int
) -> tuple[Conditioner, Standardisation]:
    """Take the statistics of z and eta over one epoch of training rows."""
    raw = [_raw(part, settings, seed, "statistics") for part in subjects]
    contexts = tuple(part.model.recording.context for part in subjects)
    conditioner = fit_conditioner(np.concatenate([part.features for part in raw]), contexts, settings)
    return conditioner, fit_standardisation(np.concatenate([part.eta for part in raw]))


def make_rows(
    subjects: Sequence[SubjectSimulations],
    conditioner: Conditioner,
    eta: Standardisation,
    seed: int,
    *name: str | int,
) -> Rows:
    """Make one epoch's rows; the stream of each subject depends on the seed, the name and the subject."""
    raw = [_raw(part, conditioner.settings, seed, *name) for part in subjects]
    z = [
        conditioner.standardise(rows.features, part.model.recording.context)
        for rows, part in zip(raw, subjects, strict=True)
    ]
    return Rows(eta.apply(np.concatenate([part.eta for part in raw])), np.concatenate(z))


def _raw(
    simulations: SubjectSimulations, settings: ConditioningSettings, seed: int, *name: str | int
) -> _Raw:
    recording = simulations.model.recording
    rng = generator(seed, "flow", *name, recording.subject)
    phi, speeds = noisy_speeds(simulations, rng)
    prior = simulations.model.settings.prior
    return _Raw(to_logit(phi, prior), raw_features(speeds, recording.phase, settings))
