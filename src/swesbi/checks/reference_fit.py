"""The CMA-ES reference fit of one subject."""

from __future__ import annotations

import logging

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.checks import cmaes
from swesbi.checks.cmaes import FAILED_LOSS, CmaesFit, best_run, curve_loss
from swesbi.checks.settings import CmaesSettings
from swesbi.checks.simulated import simulated_curves
from swesbi.heart.settings import ForwardModelSettings
from swesbi.measurement.likelihood import MeasuredSubject
from swesbi.measurement.operator import PassiveBaseline
from swesbi.measurement.settings import MeasurementSettings
from swesbi.prior import PriorSettings, bounds
from swesbi.recording.observation import Observation

LOGGER = logging.getLogger("swesbi")


class CmaesFailure(RuntimeError):
    """No simulation of the search succeeded."""


def reference_fit(
    observation: Observation,
    passive: PassiveBaseline,
    *,
    search: CmaesSettings,
    cmaes_prior: PriorSettings,
    forward_model: ForwardModelSettings,
    measurement: MeasurementSettings,
) -> CmaesFit:
    """Fit theta to the observed curve, once a seed; of the prior only the bounds count.

    Raises:
        CmaesFailure: Every simulation failed.
    """
    subject = MeasuredSubject(observation, passive, measurement)

    def curves(theta: FloatArray) -> FloatArray:
        return simulated_curves(theta, subject, forward_model)

    def loss(theta: FloatArray) -> FloatArray:
        return curve_loss(curves(theta), observation.curve_kpa, search.loss)

    runs = cmaes.search(loss, *bounds(cmaes_prior), search, label=f"CMA-ES of {observation.subject}")
    best = runs[best_run(runs)]
    if best.loss >= FAILED_LOSS:
        raise CmaesFailure(
            f"subject {observation.subject}: every simulation within the prior's bounds failed; "
            "check the subject's context and the forward model's settings"
        )
    fit = cmaes.gather(runs, curves(best.theta[None])[0], observation.grid, observation.curve_kpa)
    LOGGER.info(
        "subject %s: best loss %.4f (seed %d), RMSE %.2f kPa, theta %s, %d simulations",
        observation.subject,
        fit.loss,
        fit.best_seed,
        fit.rmse_kpa,
        np.round(fit.theta, 2).tolist(),
        int(fit.evaluations[:, -1].sum()),
    )
    return fit
