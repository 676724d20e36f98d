"""Posterior mass in the strips at the prior's bounds, against the mass that the prior has there."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from swesbi.prior import BoxPrior, ParameterPrior, bounds

FloatArray = NDArray[np.float64]
BOUNDS: Final = ("lower", "upper")
LEAST_RATIO: Final = 1e-3  # no draw in any strip: as far from the bounds as can be told
LEAST_PRIOR_MASS: Final = 1e-12


def strip_edges(prior: BoxPrior, strip_fraction: float) -> tuple[FloatArray, FloatArray]:
    """Return where the lower strips end and the upper ones begin; shape (d,) each."""
    low, high = bounds(prior)
    width = strip_fraction * (high - low)
    return low + width, high - width


def strip_mass(phi: FloatArray, weight: FloatArray, prior: BoxPrior, strip_fraction: float) -> FloatArray:
    """Return the mass of weighted draws (n, d) in the strip at each bound; shape (d, 2), lower then upper."""
    lower, upper = strip_edges(prior, strip_fraction)
    return np.stack([weight @ (phi < lower), weight @ (phi > upper)], axis=1)


def prior_strip_mass(prior: BoxPrior, strip_fraction: float) -> FloatArray:
    """Return the prior's mass in the strip at each bound; shape (d, 2), lower then upper."""
    lower, upper = strip_edges(prior, strip_fraction)
    parts = zip(prior.parameters, lower, upper, strict=True)
    return np.array([[_mass(p, p.low, edge), _mass(p, top, p.high)] for p, edge, top in parts])


def boundary_statistic(mass: FloatArray, prior_mass: FloatArray, level: float) -> FloatArray:
    """Return log10 of the largest ratio of posterior to prior mass over the strips; (n,) from (n, d, 2).

    Under the model a ratio has mean one, so it exceeds r in at most 1 of r recordings, whatever the
    strip (Markov). A strip that holds more than ``level`` of the prior can therefore never be evidence at
    that level, for its ratio stays below 1 / level; it is left out.
    """
    rare = prior_mass <= level
    ratio = strip_ratios(mass, prior_mass)[:, rare]
    return np.asarray(np.log10(ratio.max(axis=1, initial=LEAST_RATIO)))


def strip_ratios(mass: FloatArray, prior_mass: FloatArray) -> FloatArray:
    """Return posterior over prior mass in each strip, of any leading shape (..., d, 2)."""
    return np.asarray(mass / np.maximum(prior_mass, LEAST_PRIOR_MASS))


def _mass(parameter: ParameterPrior, start: float, stop: float) -> float:
    ends = np.log([start, stop, parameter.low, parameter.high])
    below = norm.cdf((ends - np.log(parameter.centre)) / parameter.log_sd)
    return float((below[1] - below[0]) / (below[3] - below[2]))
