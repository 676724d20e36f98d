"""The tests with a null distribution: what they look at in a recording, and its p-values among nulls.

Do its residuals fit, and does its posterior lie at a face of the box? Gated phases and pushes have the same
two tests. A posterior at a face of the prior's box says that the model would go on beyond it to fit the
recording. That is how a curve is found that no heart makes, though some beat comes near it.

A p-value is the share of the null at or above the statistic, which keeps its level whatever the size of the
null. Where hardly any recordings are left it is that of the tail, a generalised Pareto distribution fitted to
its exceedances. So a statistic beyond all null recordings still has a p-value (Knijnenburg et al.,
Bioinformatics 25:i161, 2009). A tail with an end, of negative shape, is replaced by the exponential one.

A posterior predictive p-value is conservative, and by how much depends on how many points a recording has.
So it is compared with those of null recordings that have nearly as many.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Annotated, Any, Final

import numpy as np
from scipy.special import chdtrc, ndtri

from swesbi.artefacts import Variable
from swesbi.base.arrays import FloatArray, IntArray, rows_of
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import PredictedSpeeds
from swesbi.parameters import NUISANCES, PHI_NAMES
from swesbi.prior import JointPriorSettings, level
from swesbi.verdict.settings import RuleSettings
from swesbi.verdict.verdict import GRADES, Status

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


SMALLEST_P: Final = 1e-6
"""A fitted tail of some hundred recordings says nothing about what is rarer."""
COUNTED: Final = 5  # null recordings at or above, whose share is the p-value; fewer are for the tail
NEAREST: Final = 200  # null recordings that one is compared with: a level of 5 % within 1.5 points


class Grade(IntEnum):
    """What a recording amounts to, from good to bad."""

    NOT_CONTRADICTED = 0
    DOUBTFUL = 1
    CONTRADICTED = 2

    @property
    def word(self) -> Status:
        """The grade as files and figures print it."""
        return GRADES[self]


@dataclass(frozen=True)
class Null:
    """The null distribution of a statistic whose large values contradict the model: n values, ascending.

    A Pareto tail begins at the edge, above which a share ``edge_p`` lies.
    """

    ordered: FloatArray
    edge: float

    @property
    def edge_p(self) -> float:
        """The share above the edge."""
        return float(np.mean(self.ordered > self.edge))

    @cached_property
    def tail(self) -> tuple[float, float]:
        """Shape and scale of the tail; its scale is zero where exceedances do not vary."""
        excess = self.ordered[self.ordered > self.edge] - self.edge
        if len(excess) < 2 or np.ptp(excess) == 0.0:
            return 0.0, 0.0
        from scipy.stats import genpareto  # a quarter of a second, which few recordings need

        shape, _, scale = genpareto.fit(excess, floc=0.0)
        if shape < 0.0:  # a tail that ends would call impossible what no recording happened to show
            shape, scale = 0.0, excess.mean()
        return float(shape), float(scale)

    def p_value(self, statistic: FloatArray) -> FloatArray:
        """Return the p-value of each statistic, any shape, between ``SMALLEST_P`` and 1."""
        above = len(self.ordered) - np.searchsorted(self.ordered, statistic, side="left")
        p = np.asarray((1.0 + above) / (1.0 + len(self.ordered)))
        rare = above < COUNTED
        if rare.any() and self.tail[1] > 0.0:
            from scipy.stats import genpareto

            excess = np.maximum(statistic - self.edge, 0.0)
            shape, scale = self.tail
            p = np.where(rare, self.edge_p * genpareto.sf(excess, shape, scale=scale), p)
        return np.clip(p, SMALLEST_P, 1.0)


def fit_null(statistics: FloatArray, tail_fraction: float) -> Null:
    """Take the null distribution of n finite statistics, its upper ``tail_fraction`` by a Pareto tail."""
    if statistics.ndim != 1 or not np.isfinite(statistics).all():
        raise ValueError(
            f"null statistics must be a vector of finite numbers; found shape {statistics.shape}"
        )
    ordered = np.sort(statistics)
    return Null(ordered, float(np.quantile(ordered, 1.0 - tail_fraction)))


def nearest(null: Misfits, points: int, declared: bool) -> Misfits:
    """Return the ``NEAREST`` null recordings by number of points, of the same kind of errors.

    There are more where several are as near as the last. Declared errors are integrated out. Raises
    ValueError where no null recording has that kind.
    """
    alike = np.flatnonzero((null.errors_log_sd > 0.0) == declared)
    if not alike.size:
        raise ValueError(
            f"none of {len(null)} null recordings has {'declared' if declared else 'known'} errors, as this "
            "recording has: make more of them, and for declared errors by a population with "
            "free_running.most_errors_log_sd above 0"
        )
    distance = np.abs(np.log(null.points[alike] / points))
    reach = np.sort(distance)[min(NEAREST, len(distance)) - 1]
    return rows_of(null, alike[distance <= reach])


def p_values(null: Misfits, misfits: Misfits, rule: RuleSettings) -> FloatArray:
    """Return the p-value of each of ``TESTS`` for each of n recordings, among those of the null; (n, 2)."""
    p = np.empty((len(misfits), len(TESTS)))
    declared, statistics = misfits.errors_log_sd > 0.0, misfits.statistics()
    for points, kind in set(zip(misfits.points.tolist(), declared.tolist(), strict=True)):
        rows = (misfits.points == points) & (declared == kind)
        for column, values in enumerate(nearest(null, points, kind).statistics().T):
            p[rows, column] = fit_null(values, rule.tail_fraction).p_value(statistics[rows, column])
    return p


def overall_p(test_p: FloatArray) -> FloatArray:
    """Return the p-value of each recording from those of its tests: (n,) from (n, T).

    Of T independent tests the smallest p-value lies below p in 1 - (1 - p)^T of all recordings (Sidak, J Am
    Stat Assoc 1967;62:626). Where they depend on each other, fewer do.
    """
    return np.asarray(1.0 - (1.0 - test_p.min(axis=1)) ** test_p.shape[1])


def single_level(level: float) -> float:
    """Return the p-value below which one of ``TESTS`` alone brings the overall one below ``level``."""
    return float(1.0 - (1.0 - level) ** (1.0 / len(TESTS)))


def grade_of(overall: float, rule: RuleSettings) -> Grade:
    """Return what an overall p-value amounts to."""
    return Grade((overall <= rule.doubtful_level) + (overall <= rule.contradicted_level))
