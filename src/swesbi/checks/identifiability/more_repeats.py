"""What more of the same recording would buy: how much narrower the intervals of its quantities would be.

The expected posterior of ``information`` at the instants that were recorded, with the errors of so many times
as many repeats, or pushes. What the model misses is one a cell of the cycle and stays, however often one
records.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.checks.identifiability.designs import design_information
from swesbi.checks.identifiability.information import (
    SimulatedStencil,
    derivatives_at,
    expected_sd,
    prior_precision,
    simulate_stencil,
)
from swesbi.checks.identifiability.likelihood import central_difference
from swesbi.checks.identifiability.noise import MeanNoise
from swesbi.measurement.derived import reported
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import SpeedRecording

TIMES: Final = (2.0, 4.0, 8.0)
"""Not without end: pushes of a cell without errors would tell what the model misses there."""


@dataclass(frozen=True)
class MoreRepeats:
    """Expected widths of intervals with more repeats.

    Attributes:
        times: By what the number of repeats is multiplied; (t,).
        width: Expected posterior sd of the log of each of q quantities, over that of the recording as it is;
            (t, q).
    """

    times: tuple[float, ...]
    width: FloatArray


def more_repeats(model: SpeedModel, phi: FloatArray, step: float) -> MoreRepeats | None:
    """Return what more repeats would buy.

    Args:
        model: Of the recording.
        phi: Posterior draws, n of them; (n, d).
        step: Of the differences in log phi.

    Returns:
        None where no draw's neighbours can all be simulated.
    """
    simulated = simulate_stencil(model, phi, step)
    at = derivatives_at(model, simulated, model.recording.phase)
    gradient = reported_gradient(model, simulated)
    works = np.all(
        [np.isfinite(each).all(axis=(1, 2)) for each in (at.log_speed_by, at.slope_by, gradient)], axis=0
    )
    if not works.any():
        return None
    at = type(at)(at.phase, at.slope[works], at.log_speed_by[works], at.slope_by[works])
    now = mean_noise(model.recording)
    noises = [now, *(now.of(times) for times in TIMES)]
    cell = model.recording.cells
    together = np.equal.outer(cell, cell).astype(np.float64)[None]
    information = design_information(at, noises, model.settings.discrepancy, together)
    precision = prior_precision(model.settings.prior)
    sd = expected_sd(precision, information, gradient[works])
    return MoreRepeats(TIMES, sd[1:] / sd[0])


def reported_gradient(model: SpeedModel, simulated: SimulatedStencil) -> FloatArray:
    """Return d log quantity / d log phi of all that an answer reports, at n phi; shape (n, q, d)."""
    shape, d = simulated.log_phi.shape[:2], simulated.log_phi.shape[-1]
    quantities = reported(model, np.exp(simulated.log_phi).reshape(-1, d), simulated.beats)
    log_quantity = np.log(np.stack(list(quantities.values()), axis=-1)).reshape(*shape, -1)
    return np.asarray(central_difference(log_quantity, simulated.step).swapaxes(1, 2))


def mean_noise(recording: SpeedRecording) -> MeanNoise:
    """Return the mean squared relative errors of a recording: each speed's own, and what sweeps share."""
    shared = np.sum(recording.shared**2, axis=1)
    return MeanNoise(float(np.mean(recording.relative_se**2)), float(np.mean(shared)))
