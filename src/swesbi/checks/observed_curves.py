"""Curves as a new observation would show them: the feature noise of the paper's Eq. 5 put back on curves.

Eq. 5 adds Gaussian noise to five features of a curve and to no value of the curve itself, so it says of no
phase how far a new recording may lie from the simulated curve. A predictive interval under the observation
model asks for that, and so for a reading of what each noise does to the whole curve:

``maximum_kpa``
    A scale of the whole curve, baseline included: E -> E (1 + epsilon / max E). The maximum then moves by
    epsilon, as in Eq. 5, and every phase in proportion, which is what one error of the speed's scale does
    to E = 3 rho c^2. Eq. 5 gives baseline and minimum no noise of their own; ``about_kpa`` scales the height
    about a given baseline instead, which leaves late diastole where it is.
``time_to_peak_cycle``
    A shift of the whole curve along the cycle, around its end: E(s) -> E(s - epsilon). The peak then moves by
    epsilon, as in Eq. 5. A scale leaves the phase of the peak, and a shift leaves its height, so that
    both features have the noise of Eq. 5 and no more.
``auc_kpa``, ``post_peak_auc_kpa``, ``decay_slope_kpa_per_cycle``
    Nothing more. They stay as Eq. 5 defines them, noise added to the feature of a drawn curve
    (:func:`swesbi.checks.predictive_features.replicates`): an area or a slope belongs to infinitely many
    curves, and no one deformation of a curve to it. Scale and shift move them already. Under 1 kPa and 0.03
    of the cycle the area of the six volunteers' prior curves moves by 0.4 kPa (Eq. 5: 0.5), that after the
    peak by 0.3 kPa (0.5) and the decay slope from the peak to the end by 3 to 5 kPa per cycle (5): a third
    move for each would count that noise twice.

The trajectory values, which Eq. 5 does "not independently" perturb, so move with the curve that they are of.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray

SCALED_BY: Final = "maximum_kpa"
SHIFTED_BY: Final = "time_to_peak_cycle"


def observed_curves(
    curves_kpa: FloatArray,
    feature_noise_sd: Mapping[str, float],
    rng: np.random.Generator,
    about_kpa: FloatArray | float = 0.0,
) -> FloatArray:
    """Return each curve as one new observation would show it: scaled, and shifted along the cycle.

    Args:
        curves_kpa: Curves on the analysis grid, the last value equal to the first; shape (n, G).
        feature_noise_sd: Of the observation model; ``SCALED_BY`` and ``SHIFTED_BY`` move whole curves.
        rng: Draws one scale and one shift a curve, in this order.
        about_kpa: Stiffness about which curves are scaled, of shape (n,) or one for all.

    Returns:
        Curves of shape (n, G); ``curves_kpa`` where both standard deviations are zero.
    """
    raised, shift = rng.standard_normal((2, len(curves_kpa)))
    scaled = scale_peaks(curves_kpa, feature_noise_sd.get(SCALED_BY, 0.0) * raised, about_kpa)
    return shift_cycles(scaled, feature_noise_sd.get(SHIFTED_BY, 0.0) * shift)


def scale_peaks(curves_kpa: FloatArray, raised_kpa: FloatArray, about_kpa: FloatArray | float) -> FloatArray:
    """Scale curves (n, G) about a stiffness so that their maxima rise by ``raised_kpa`` (n,).

    A curve that nowhere exceeds that stiffness has no height to scale, and stays.
    """
    about = np.broadcast_to(about_kpa, len(curves_kpa))[:, None]
    height = curves_kpa.max(axis=1, keepdims=True) - about
    tall = height > 0.0
    factor = np.where(tall, raised_kpa[:, None] / np.where(tall, height, 1.0), 0.0)
    return np.asarray(curves_kpa + factor * (curves_kpa - about))


def shift_cycles(curves_kpa: FloatArray, shift_cycle: FloatArray) -> FloatArray:
    """Move curves (n, G) later by ``shift_cycle`` (n,), around the cycle: E(s - shift).

    Between points of the grid the curve is linear; a shift by whole steps moves values as they are.
    """
    steps = curves_kpa.shape[1] - 1
    return _read(curves_kpa, np.arange(steps + 1) - steps * shift_cycle[:, None])


def at_phases(curves_kpa: FloatArray, phase: FloatArray) -> FloatArray:
    """Return curves (n, G) of the analysis grid at phases (p,), linearly between its points; shape (n, p)."""
    return _read(
        curves_kpa, np.broadcast_to((curves_kpa.shape[1] - 1) * phase, (len(curves_kpa), len(phase)))
    )


def _read(curves: FloatArray, position: FloatArray) -> FloatArray:
    """Read each curve at its own positions (n, p), counted in steps of the grid around the cycle."""
    steps, rows = curves.shape[1] - 1, np.arange(len(curves))[:, None]
    start = np.floor(position)
    before = start.astype(np.int64) % steps
    fraction = position - start
    return np.asarray((1.0 - fraction) * curves[rows, before] + fraction * curves[rows, before + 1])
