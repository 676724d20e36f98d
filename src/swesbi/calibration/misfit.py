"""How well posterior draws fit their recording."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.speed_model.likelihood import residuals
from swesbi.speed_model.model import SpeedModel

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Misfit:
    """Sum of squared standardised residuals over posterior draws: the smallest, and the mean."""

    min_chi2: float
    mean_chi2: float


def misfit(model: SpeedModel, phi: FloatArray) -> Misfit:
    """Return the misfit of equally weighted posterior draws (n, 4); failed simulations drop out."""
    z = residuals(model.predict(phi), model.recording, model.settings.discrepancy)
    chi2 = (z**2).sum(axis=1)
    return Misfit(float(np.nanmin(chi2)), float(np.nanmean(chi2)))
