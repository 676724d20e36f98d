"""What more of the same recording would buy: how much narrower the intervals of its quantities would be.

The expected posterior at the instants that were recorded, with the errors of so many times as many repeats,
or pushes. What the model misses is one a cell of the cycle and stays, however often one records.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.checks.identifiability.information import Expectation, Stencil, simulated_stencil
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
    """Return what more repeats would buy of all that an answer reports.

    Args:
        model: Of the recording.
        phi: Posterior draws, n of them; (n, d).
        step: Of the differences in log phi.

    Returns:
        None where no draw's neighbours can all be simulated.
    """
    simulated = simulated_stencil(model, phi, step)
    expected = Expectation.of(model, simulated, reported_gradient(model, simulated))
    return repeats_of(expected) if len(expected.gradient) else None


def repeats_of(expected: Expectation) -> MoreRepeats:
    """Return what more repeats would buy of the quantities of an expectation."""
    recording = expected.model.recording
    widths = [expected.sd(repeated(recording, times)) for times in TIMES]
    return MoreRepeats(TIMES, np.stack(widths) / expected.sd(recording))


def repeated(recording: SpeedRecording, times: float) -> SpeedRecording:
    """Return a recording with the errors of so many times as many repeats."""
    part = times**-0.5
    return replace(recording, relative_se=part * recording.relative_se, shared=part * recording.shared)


def reported_gradient(model: SpeedModel, simulated: Stencil) -> FloatArray:
    """Return d log quantity / d log phi of all that an answer reports, at n phi; shape (n, q, d)."""
    quantities = reported(model, simulated.rows, simulated.beats)
    log_quantity = np.log(np.stack(list(quantities.values()), axis=-1))
    return np.asarray(np.swapaxes(simulated.derivatives(log_quantity), 1, 2))
