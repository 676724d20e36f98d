"""Under which structure a measured ejection time may enter the likelihood: one that ejects as people do.

A structure whose hearts all eject too briefly would pay for a true ejection time with parameters that are
wrong. So its prior predictive must hold what is published before the time is a datum; else it is a check.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from studies.ladder.timing import RANGES
from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.heart.intervals import systolic_intervals
from swesbi.heart.physiology import Physiology
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import simulate
from swesbi.parameters import THETA
from swesbi.prior import PriorSettings, SimulatedPrior, sample
from swesbi.seeds import generator

PUBLISHED_MS: Final = RANGES["lvet_ms"]


def prior_predictive_lvet_ms(
    contexts: Sequence[Context], prior: PriorSettings, settings: ForwardModelSettings, draws: int, seed: int
) -> FloatArray:
    """Return ejection times (ms) of hearts from the prior, NaN where there is no beat or no ejection.

    Args:
        contexts: Of C healthy adults at rest.
        prior: Of theta and free physiology.
        settings: The structure.
        draws: Hearts a context.
        seed: Of the draws, which are the same under every structure with the same prior.

    Returns:
        Shape (C, draws).
    """
    return np.stack([_of_context(context, prior, settings, draws, seed) for context in contexts])


def _of_context(
    context: Context, prior: PriorSettings, settings: ForwardModelSettings, draws: int, seed: int
) -> FloatArray:
    rng = generator(seed, "prior predictive ejection", context.subject)
    drawn = sample(draws, SimulatedPrior(theta=prior), rng)
    theta, values = np.split(drawn, [len(THETA)], axis=1)
    physiology = Physiology.of_nuisances(values, prior.physiology_names, settings)
    beats = simulate(theta, context, settings, physiology)
    return 1e3 * systolic_intervals(beats, context.period_s).ejection_s


def holds_published(lvet_ms: FloatArray) -> bool:
    """Tell whether prior predictive ejection times have their median within what is published.

    Raises:
        ValueError: None of them is a time.
    """
    if not np.isfinite(lvet_ms).any():
        raise ValueError("no heart of the prior ejects; check structure and prior")
    low, high = PUBLISHED_MS
    return bool(low <= np.nanmedian(lvet_ms) <= high)
