"""Settings of the posterior of a cohort: hyperpriors, outliers, recycled draws."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from swesbi.base.settings import Settings
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import ParameterPrior

Probability = Annotated[float, Field(ge=0.0, lt=1.0)]


class HyperpriorSettings(Settings):
    """Bounded log-Gaussian hyperpriors, each of every parameter; medians have the prior of theta itself."""

    spread: ParameterPrior = Field(description="of the standard deviation of log theta between subjects")
    age_factor: ParameterPrior = Field(description="of a parameter's factor per ten years")
    sex_factor: ParameterPrior = Field(description="of a parameter's factor, male over female")
    heart_rate_factor: ParameterPrior = Field(description="of its factor per ten beats per minute")
    group_factor: ParameterPrior = Field(description="of a group's factor against the first group")


class OutlierSettings(Settings):
    """Probability that a subject is none of the population, by verdict."""

    supported: Probability = Field(description="of a subject whose recording the model supports")
    strained: Probability = Field(description="of one whose recording strains the model")
    unsupported: Probability = Field(description="of one whose recording the model cannot have made")

    def of(self, status: str) -> float:
        """Return the probability of a verdict.

        Raises:
            ValueError: There is no such verdict.
        """
        if status not in type(self).model_fields:
            raise ValueError(f"verdict {status!r}: expected one of {', '.join(type(self).model_fields)}")
        return float(getattr(self, status))


class HierarchySettings(Settings):
    """The posterior of the population, and what is recycled of each subject's own."""

    draws: int = Field(ge=50, description="draws recycled of each subject's posterior")
    rough_draws: int = Field(ge=20, description="of these, for the first proposal of large cohorts")
    least_effective: float = Field(gt=1.0, description="of these under the population; else drawn anew")
    refreshes: int = Field(ge=0, description="rounds of drawing anew, at most")
    shown_draws: int = Field(ge=100, description="draws of the population's posterior that are stored")
    outliers: OutlierSettings
    hyperprior: HyperpriorSettings
    exact: ExactSettings
