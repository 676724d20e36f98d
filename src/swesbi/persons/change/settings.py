"""Settings of a person's visits: what they share, when a change counts, the effort of the joint posterior."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Final

import numpy as np
from pydantic import Field

from swesbi.base.arrays import FloatArray
from swesbi.base.settings import Level, Settings
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import ParameterPrior

Share = Annotated[float, Field(ge=0.0, le=1.0)]
DISCREPANCY: Final = "discrepancy"


class SharesSettings(Settings):
    """What two visits of one person have in common; every other parameter is each visit's own.

    Of a parameter it is the correlation of its normal scores: 0 makes the visits strangers in it, 1 gives
    them one value. Of the discrepancy it is the share of its variance that is the same at the same phase.
    """

    activation_ramp_s: Share
    destruction_alpha: Share
    sigma_0_pa: Share
    passive_wall_factor: Share
    exponent_b: Share
    passive_compression_factor: Share
    speed_scale: Share
    discrepancy: Share

    def of(self, names: Sequence[str]) -> FloatArray:
        """Return the share of each of these parameters, 0 where it is the visit's own; shape (d,)."""
        shares = self.model_dump()
        return np.array([shares.get(name, 0.0) for name in names])

    @property
    def by_name(self) -> dict[str, float]:
        """All of them, the discrepancy's last."""
        return {name: float(value) for name, value in self.model_dump().items()}


class ChangeRuleSettings(Settings):
    """When a quantity has changed, and when two recordings are not of one person."""

    threshold: float = Field(gt=0.0, lt=1.0, description="of a ratio: smaller changes do not count")
    probability: Level = Field(
        description="of a change beyond the threshold in one direction, above which it is one"
    )
    power: Level = Field(description="with which the smallest detectable change is found")
    one_person_level: float = Field(
        gt=0.0, lt=0.5, description="of the test that both recordings are of one person: its false alarms"
    )
    null_draws: int = Field(ge=100, description="simulated pairs of one person behind that test")


class ChangeSettings(Settings):
    """The joint posterior of a person's visits, and what is told of it."""

    shares: SharesSettings
    rule: ChangeRuleSettings
    exact: ExactSettings


class RatioHyperpriorSettings(Settings):
    """Bounded log-Gaussian hyperpriors of what has changed between two visits, each of every parameter."""

    median: ParameterPrior = Field(description="of the ratio of later to earlier, of the middle person")
    spread: ParameterPrior = Field(description="of the standard deviation of the log ratio between persons")
    group_factor: ParameterPrior = Field(description="of a group's ratio over that of the first group")


class ChangeGroupsSettings(Settings):
    """What has changed in groups of persons; outliers and effort are those of the posterior of a cohort."""

    draws: int = Field(ge=50, description="draws recycled of each person's joint posterior")
    least_effective: float = Field(
        gt=1.0, description="of these under the population; a person with fewer is named"
    )
    hyperprior: RatioHyperpriorSettings
