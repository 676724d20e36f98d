"""How well posterior draws fit their recording."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swesbi.speed_model.likelihood import residuals
from swesbi.speed_model.model import SpeedModel
from swesbi.speed_model.prediction import PredictedSpeeds


@dataclass(frozen=True)
class Misfit:
    """Sum of squared standardised residuals over posterior draws: the smallest, and the mean."""

    min_chi2: float
    mean_chi2: float


def misfit(model: SpeedModel, predicted: PredictedSpeeds) -> Misfit:
    """Return the misfit of what equally weighted posterior draws predict; failed simulations drop out."""
    z = residuals(predicted, model.recording, model.settings.discrepancy)
    chi2 = (z**2).sum(axis=1)
    return Misfit(float(np.nanmin(chi2)), float(np.nanmean(chi2)))
