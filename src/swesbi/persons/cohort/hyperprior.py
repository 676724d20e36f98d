"""The prior of what a population is like: positive hyperparameters, each bounded and log-Gaussian."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.parameters import THETA_NAMES
from swesbi.persons.cohort.cohort import AGE, HEART_RATE, SEX, Design
from swesbi.persons.cohort.settings import HyperpriorSettings
from swesbi.prior import ParameterPrior, PriorSettings

MEDIAN: Final = "median"
SPREAD: Final = "spread"
FACTOR: Final = "factor"


@dataclass(frozen=True)
class Hyperprior:
    """Independent priors of the hyperparameters eta, three in a row, a row after another.

    Rows are the population's median of each parameter, its spread (standard deviation of log theta), then
    one for each column of the design: the factor of each parameter per step.

    Attributes:
        rows: Name of each row.
        parameters: Priors of the 3 r hyperparameters.
    """

    rows: tuple[str, ...]
    parameters: tuple[ParameterPrior, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the 3 r hyperparameters."""
        return tuple(f"{row} {parameter}" for row in self.rows for parameter in THETA_NAMES)


def hyperprior_of(design: Design, theta: PriorSettings, settings: HyperpriorSettings) -> Hyperprior:
    """Return the hyperprior of a cohort.

    The prior of theta says where one heart may lie before it is measured; where the middle of all lies is not
    known better beforehand, so the medians have that prior.
    """
    factors = {AGE: settings.age_factor, SEX: settings.sex_factor, HEART_RATE: settings.heart_rate_factor}
    rows: list[tuple[str, tuple[ParameterPrior, ...]]] = [
        (MEDIAN, theta.parameters),
        (SPREAD, (settings.spread,) * len(THETA_NAMES)),
    ]
    rows += [(f"{name} {FACTOR}", (factors[name],) * len(THETA_NAMES)) for name in design.covariates]
    rows += [
        (f"{group} {FACTOR}", (settings.group_factor,) * len(THETA_NAMES)) for group in design.groups[1:]
    ]
    return Hyperprior(
        rows=tuple(name for name, _ in rows),
        parameters=tuple(parameter for _, priors in rows for parameter in priors),
    )


def in_rows(eta: FloatArray) -> FloatArray:
    """Return eta (..., 3 r) as (..., r, 3): a row a kind of hyperparameter, a column a parameter."""
    return np.reshape(eta, (*eta.shape[:-1], -1, len(THETA_NAMES)))
