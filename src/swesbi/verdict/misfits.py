"""What the tests look at in a recording: do its residuals fit, does its posterior lie at a face of the box?

Gated phases and pushes have the same two tests. A posterior at a face of the prior's box says that the
model would go on beyond it to fit the recording. That is how a curve is found that no heart makes, though
some beat comes near it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Final

import numpy as np
from scipy.special import chdtrc, ndtri

from swesbi.artefacts import Variable
from swesbi.base.arrays import FloatArray, IntArray
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import PredictedSpeeds
from swesbi.parameters import NUISANCES, PHI_NAMES
from swesbi.prior import JointPriorSettings, level

BOUNDS: Final = ("lower", "upper")
WITH_STRIPS: Final = (*PHI_NAMES, *(parameter.name for parameter in NUISANCES))
"""Parameters with strips at both faces of the box: all that a prior may free."""
STRIP_LABELS: Final[dict[str, Any]] = {"bounded": list(WITH_STRIPS), "bound": list(BOUNDS)}
"""Of the dimensions of ratios."""
STRIP_MASSES: Final = (0.01, 0.02, 0.04)
"""Of the prior in the strips at each face. Where the prior has much at a face, they are narrow."""
LEAST_RATIO: Final = 1e-3  # no draw in any strip: as far from the faces as can be told
LEAST_P: Final = 1e-6
LARGEST_P: Final = 1.0 - 1e-3
TESTS: Final = ("residuals", "boundary_mass")
"""The tests with a null distribution, in the order of their statistics."""


@dataclass(frozen=True)
class Misfits:
    """What the tests look at in n recordings, all gated or all free-running."""

    points: Annotated[IntArray, Variable("recording", "1", "measured phases, or accepted pushes")]
    error_fraction: Annotated[
        FloatArray, Variable("recording", "1", "mean of the standard errors of the speeds, over them")
    ]
    errors_log_sd: Annotated[
        FloatArray, Variable("recording", "1", "prior sd of the log of a factor of all errors, 0 where known")
    ]
    residuals_p: Annotated[
        FloatArray, Variable("recording", "1", "posterior predictive p-value of the squared residuals")
    ]
    bound_ratio: Annotated[
        FloatArray,
        Variable("recording bounded bound", "1", "posterior over prior mass at the face"),
    ]

    def __len__(self) -> int:
        return len(self.points)

    def statistics(self) -> FloatArray:
        """Return the statistic of each of ``TESTS``, large where the model misfits; shape (n, 2)."""
        misfit = -ndtri(np.clip(self.residuals_p, LEAST_P, LARGEST_P))
        return np.stack([misfit, boundary_statistic(self.bound_ratio)], axis=1)


def misfits_of(
    model: SpeedModel,
    phi: FloatArray,
    weight: FloatArray,
    predicted: PredictedSpeeds,
    rng: np.random.Generator,
) -> Misfits:
    """Return what the tests look at in one recording, as one row.

    Draws phi (n, d) have weights (n,) that sum to one; ``predicted`` is of equally weighted ones. ``rng``
    draws the factor of the errors, where these are not known.
    """
    points = len(model.recording.phase)
    return Misfits(
        points=np.array([points]),
        error_fraction=np.array([model.recording.errors.total.mean()]),
        errors_log_sd=np.array([model.recording.errors_log_sd]),
        residuals_p=np.array([residuals_p_value(model.chi_squared(predicted, rng), points)]),
        bound_ratio=strip_ratios(phi, weight, model.settings.prior)[None],
    )


def residuals_p_value(chi_squared: FloatArray, points: int) -> float:
    """Return the posterior predictive p-value of squared residuals (n,), over factors of the errors too.

    Given phi and the factor, the residuals of a new recording are independent standard normals, also where
    phases share errors. So the p-value of each draw is that of chi-squared with as many degrees of freedom as
    there are speeds (Gelman, Meng and Stern, Statistica Sinica 6:733, 1996).
    """
    return float(np.mean(chdtrc(points, chi_squared)))


def strip_ratios(phi: FloatArray, weight: FloatArray, prior: JointPriorSettings) -> FloatArray:
    """Return posterior over prior mass at each face of the box, averaged over strips of ``STRIP_MASSES``.

    Under the model each ratio has mean one over recordings, whatever the strip. Draws phi (n, d) have weights
    (n,) that sum to one. Ratios (m, 2) are of ``WITH_STRIPS``, lower then upper; NaN of what is fixed.
    """
    below = level(phi, prior)
    ratios = np.full((len(WITH_STRIPS), len(BOUNDS)), np.nan)
    for column, name in enumerate(prior.names):
        for bound, inside in enumerate((below[:, column], 1.0 - below[:, column])):
            ratios[WITH_STRIPS.index(name), bound] = np.mean(
                [weight @ (inside < mass) / mass for mass in STRIP_MASSES]
            )
    return ratios


def boundary_statistic(ratios: FloatArray) -> FloatArray:
    """Return log10 of the mean ratio over all faces of the box; (n,) from (n, m, 2).

    A mean of variables with mean one has mean one, however they depend on each other. So it exceeds r in at
    most 1 of r recordings (Markov; Vovk and Wang, Ann Stat 2021;49:1736). Nothing is left out, and a
    posterior that lies at several faces counts for more than one that lies at one.
    """
    return np.asarray(np.log10(np.maximum(np.nanmean(ratios, axis=(1, 2)), LEAST_RATIO)))
