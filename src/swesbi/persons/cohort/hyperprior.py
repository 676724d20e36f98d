"""The prior of what a population is like: positive hyperparameters, each bounded and log-Gaussian."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.parameters import THETA_NAMES
from swesbi.persons.cohort.cohort import Design
from swesbi.persons.cohort.settings import HyperpriorSettings, RatioHyperpriorSettings
from swesbi.prior import ParameterPrior

MEDIAN: Final = "median"
SPREAD: Final = "spread"
FACTOR: Final = "factor"


@dataclass(frozen=True)
class Hyperprior:
    """Independent priors of the hyperparameters eta, three in a row, a row after another.

    Rows are the population's median of each parameter, its spread (standard deviation of its logarithm), then
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


def hyperprior_of(
    design: Design,
    median: Sequence[ParameterPrior],
    settings: HyperpriorSettings | RatioHyperpriorSettings,
) -> Hyperprior:
    """Return the hyperprior of a population.

    Args:
        design: Its covariates and groups.
        median: Prior of the median of each parameter.
        settings: Priors of the spread and of the factors of covariates and groups.
    """
    of_covariates = [(name, getattr(settings, f"{name}_factor")) for name in design.covariates]
    factors = of_covariates + [(group, settings.group_factor) for group in design.groups[1:]]
    alike = [(SPREAD, settings.spread), *((f"{name} {FACTOR}", prior) for name, prior in factors)]
    return Hyperprior(
        rows=(MEDIAN, *(name for name, _ in alike)),
        parameters=(*median, *(prior for _, prior in alike for _ in THETA_NAMES)),
    )


def in_rows(eta: FloatArray) -> FloatArray:
    """Return eta (..., 3 r) as (..., r, 3): a row a kind of hyperparameter, a column a parameter."""
    return np.reshape(eta, (*eta.shape[:-1], -1, len(THETA_NAMES)))
