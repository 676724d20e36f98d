"""Has the posterior of a quantity two modes? Then its median may lie where hardly any draw is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.verdict.answer_lines import ANSWER_LINES

POINTS: Final = 200
TAILS: Final = 0.005  # left out on either side: single draws there are no modes
LEAST_MASS: Final = 0.1  # on either side of a valley
DEEPEST: Final = 0.7  # of the lower mode: a valley below it parts them; chance makes shallower ones
LEAST_DRAWS: Final = 50


def two_modes(values: FloatArray) -> tuple[float, float] | None:
    """Return the two modes of draws (n,), the lower value first; None where there is one.

    The density is a sum of normal kernels of Silverman's width (Density Estimation, 1986, Eq. 3.31).
    """
    known = values[np.isfinite(values)]
    low, high = np.quantile(known, [TAILS, 1.0 - TAILS]) if len(known) else (0.0, 0.0)
    if len(known) < LEAST_DRAWS or not low < high:
        return None
    quartiles = np.quantile(known, [0.25, 0.75])
    spread = min(known.std(), (quartiles[1] - quartiles[0]) / 1.34)
    if spread == 0.0:
        return None
    width = 0.9 * spread * len(known) ** -0.2 / known.std(ddof=1)
    at = np.linspace(low, high, POINTS)
    from scipy.stats import gaussian_kde  # a quarter of a second, which no other verdict need wait for

    density = gaussian_kde(known, bw_method=width)(at)
    before, after = np.maximum.accumulate(density), np.maximum.accumulate(density[::-1])[::-1]
    below = np.searchsorted(np.sort(known), at) / len(known)
    parted = (below >= LEAST_MASS) & (below <= 1.0 - LEAST_MASS)
    lower, depth = np.minimum(before, after), np.ones(POINTS)
    # of a few distinct draws the density may vanish on one side
    np.divide(density, lower, out=depth, where=parted & (lower > 0.0))
    valley = int(depth.argmin())
    if depth[valley] > DEEPEST:
        return None
    return float(at[density[:valley].argmax()]), float(at[valley + density[valley:].argmax()])


def modes_in_words(reported: Mapping[str, FloatArray]) -> tuple[str, ...]:
    """Return a sentence for each quantity of an answer, by name, whose draws (n,) have two modes."""
    found = ((line.parameter, two_modes(reported[line.parameter.name])) for line in ANSWER_LINES)
    return tuple(
        f"{parameter.meaning} has two modes, about {modes[0]:.3g} and {modes[1]:.3g}"
        f"{'' if parameter.unit == '1' else f' {parameter.unit}'}"
        for parameter, modes in found
        if modes is not None
    )
