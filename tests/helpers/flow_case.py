"""A flow trained for a moment on prior simulations of one subject, with nuisances or without."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import speed_case

from swesbi.heart.periodic import Status
from swesbi.networks.flow.conditioning import ConditioningSettings
from swesbi.networks.flow.pool import SubjectSimulations
from swesbi.networks.flow.training import TrainedWithLosses, train_over_subjects
from swesbi.networks.settings import EmbeddingSettings
from swesbi.parameters import OF_THETA
from swesbi.prior import draw_prior

EXPERIMENT = speed_case.shipped().speed_experiments["calibrated"]
CONDITIONING = ConditioningSettings(summary=EXPERIMENT.summary, grid_points=100, density_kg_m3=1000.0)
SMALL: dict[str, Any] = {
    "transforms": 2,
    "hidden_features": 24,
    "hidden_layers": 1,
    "batch_size": 128,
    "learning_rate": 2e-3,
}
TINY = EXPERIMENT.estimator.model_copy(
    update={
        **SMALL,
        "embedding": EmbeddingSettings(hidden_features=32, hidden_layers=1, outputs=8),
        "epochs": 12,
    }
)


@cache
def simulations(count: int = 2000, prior: str = "paper") -> SubjectSimulations:
    model = speed_case.model(prior=prior)
    phi = draw_prior(model.settings.prior, count, np.random.default_rng(1))
    beats = model.simulate(phi)
    good = beats.status == Status.PERIODIC
    physiology, wall = model.settings.prior.physiology(phi[good]), model.wall_at_phases(beats).rows(good)
    return SubjectSimulations(model, phi[good, OF_THETA], physiology, wall)


@cache
def trained(prior: str = "paper", count: int = 2000, epochs: int = TINY.epochs) -> TrainedWithLosses:
    settings = TINY.model_copy(update={"epochs": epochs})
    return train_over_subjects([simulations(count, prior)], CONDITIONING, settings, seed=3)
