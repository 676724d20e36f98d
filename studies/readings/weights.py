"""The CMA-ES reference under other weights of its loss."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from studies.readings.settings import WeightsSettings
from swesbi.base.arrays import FloatArray
from swesbi.checks.cmaes import best_run, curve_loss, search
from swesbi.checks.draws import simulated_curves
from swesbi.checks.scores import rmse
from swesbi.checks.settings import CmaesSettings
from swesbi.heart.settings import ForwardModelSettings
from swesbi.measurement.likelihood import MeasuredSubject
from swesbi.prior import PriorSettings, bounds


@dataclass(frozen=True)
class WeightsRow:
    """The best fit of one subject under one choice of weights."""

    subject: str
    mae_weight: float
    correlation_weight: float
    peak_weight: float
    loss: float
    rmse_kpa: float


def fits_by_weights(
    subject: MeasuredSubject,
    settings: WeightsSettings,
    cmaes: CmaesSettings,
    prior: PriorSettings,
    forward_model: ForwardModelSettings,
) -> Iterator[WeightsRow]:
    """Search anew under every choice of weights; yield the error of each best fit on the grid."""
    observed = subject.observation.curve_kpa

    def curves(theta: FloatArray) -> FloatArray:
        return simulated_curves(theta, subject, forward_model)

    for weights in settings.weights:
        chosen = cmaes.model_copy(update={"loss": weights, "seeds": settings.seeds})

        def loss(theta: FloatArray, chosen: CmaesSettings = chosen) -> FloatArray:
            return curve_loss(curves(theta), observed, chosen.loss)

        label = f"CMA-ES of {subject.observation.subject}"
        runs = search(loss, *bounds(prior), chosen, label=label)
        best = runs[best_run(runs)]
        yield WeightsRow(
            subject=subject.observation.subject,
            mae_weight=weights.mae_weight,
            correlation_weight=weights.correlation_weight,
            peak_weight=weights.peak_weight,
            loss=best.loss,
            rmse_kpa=rmse(observed, np.asarray(curves(best.theta[None])[0])),
        )
