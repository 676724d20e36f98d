"""The CMA-ES reference fit of one subject."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import Origin, save
from swesbi.base.settings import Settings
from swesbi.checks.cmaes import FAILED_LOSS, KIND, CmaesFit, best_run, curve_loss, gather, search, to_dataset
from swesbi.checks.draws import simulated_curves
from swesbi.checks.settings import CmaesSettings
from swesbi.heart.settings import ForwardModelSettings
from swesbi.measurement.likelihood import MeasuredSubject
from swesbi.measurement.operator import read_passive
from swesbi.measurement.settings import MeasurementSettings
from swesbi.prior import PriorSettings, bounds
from swesbi.recording.observation import read_observation

FloatArray = NDArray[np.float64]
LOGGER = logging.getLogger("swesbi")


class CmaesStageSettings(Settings):
    """What the fit depends on; of the prior only the bounds count."""

    search: CmaesSettings
    prior: PriorSettings
    forward_model: ForwardModelSettings
    measurement: MeasurementSettings


class CmaesFailure(RuntimeError):
    """No simulation of the search succeeded."""


def cmaes(
    *, observation: Path, passive: Path, cmaes: Path, settings: CmaesStageSettings, origin: Origin
) -> None:
    """Fit theta to the observed curve, once a seed, and write every run's history and the best fit.

    Raises:
        CmaesFailure: Every simulation failed.
    """
    observed = read_observation(observation)
    fit = fitted(MeasuredSubject(observed, read_passive(passive), settings.measurement), settings)
    save(cmaes, to_dataset(fit), origin.provenance(KIND, settings))
    LOGGER.info(
        "subject %s: best loss %.4f (seed %d), RMSE %.2f kPa, theta %s, %d simulations",
        observed.subject,
        fit.loss,
        fit.best_seed,
        fit.rmse_kpa,
        np.round(fit.theta, 2).tolist(),
        int(fit.evaluations[:, -1].sum()),
    )


def fitted(subject: MeasuredSubject, settings: CmaesStageSettings) -> CmaesFit:
    """Return the best fit to a recording of all runs.

    Raises:
        CmaesFailure: Every simulation failed.
    """
    observed = subject.observation

    def curves(theta: FloatArray) -> FloatArray:
        return simulated_curves(theta, subject, settings.forward_model)

    def loss(theta: FloatArray) -> FloatArray:
        return curve_loss(curves(theta), observed.curve_kpa, settings.search.loss)

    runs = search(loss, *bounds(settings.prior), settings.search, label=f"CMA-ES of {observed.subject}")
    best = runs[best_run(runs)]
    if best.loss >= FAILED_LOSS:
        raise CmaesFailure(
            f"subject {observed.subject}: every simulation within the prior's bounds failed; "
            "check the subject's context and the forward model's settings"
        )
    return gather(runs, curves(best.theta[None])[0], observed.grid, observed.curve_kpa)
