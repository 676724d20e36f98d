"""Settings of a person's visits: what they share, when a change counts, the effort of the joint posterior."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from pydantic import Field

from swesbi.base.arrays import FloatArray
from swesbi.base.settings import Level, Settings
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import ParameterPrior

Share = Annotated[float, Field(ge=0.0, le=1.0, json_schema_extra={"unit": "1"})]


class SharesSettings(Settings):
    """What two visits of one person have in common; every other parameter is each visit's own.

    Of a parameter it is the correlation of its normal scores: 0 makes the visits strangers in it, 1 gives
    them one value. Of the discrepancy it is the share of its variance that is the same at the same phase.

    Each visit's own are theta, the passive stiffness, loading (R_d, R_d C_s, the stressed volume), onset
    and duration of activation. There are no repeated measurements of any. Chosen: .9 of an organ that
    is the same. Visits of one person so make a tenth of the variance over persons and visits. What the
    investigator sets anew has .8.
    """

    activation_ramp_s: Share = Field(
        description="Share of the width of the ramps of activation. Chosen: the organ is the same."
    )
    destruction_alpha: Share = Field(
        description="Share of the bonds destroyed per unit of strain. Chosen: the organ is the same."
    )
    sigma_0_pa: Share = Field(
        description="Share of the stress of the fully activated fibre. Chosen: the organ is the same."
    )
    passive_wall_factor: Share = Field(
        description="Share of the factor of the passive wall's moduli. Chosen: the organ is the same."
    )
    length_dependence: Share = Field(
        description="Share of the length dependence of the bonds. Chosen: the organ is the same."
    )
    passive_ratio: Share = Field(
        description="Share of the ratio of the passive stiffness at both ends. Chosen: the organ is the same."
    )
    passive_middle_factor: Share = Field(
        description="Share of the factor of the passive stiffness between. Chosen: the organ is the same."
    )
    speed_scale: Share = Field(
        description="Share of the scale of all speeds. Chosen: plate thickness and dispersion stay, the "
        "angle to the fibres is set anew."
    )
    discrepancy: Share = Field(
        description="Share of the variance of the discrepancy, at the same phase. Chosen: equations that "
        "miss a heart miss it again."
    )

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

    threshold: float = Field(
        gt=0.0,
        lt=1.0,
        description="Smallest relative change that counts. Chosen: a smaller change of the ratio is none.",
    )
    probability: Level = Field(
        description="Probability of a change beyond the threshold in one direction, above which it is "
        "one. Chosen."
    )
    power: Level = Field(
        description="Power with which the smallest detectable change is found. As studies are planned."
    )
    one_person_level: float = Field(
        gt=0.0,
        lt=0.5,
        description="False-alarm rate of the test that both recordings are of one person. Chosen.",
    )
    null_draws: int = Field(
        ge=100,
        description="Simulated pairs of one person behind that test. Chosen: p-values of .05 to half a "
        "point.",
    )


class ChangeSettings(Settings):
    """The joint posterior of a person's visits, and what is reported of it."""

    shares: SharesSettings = Field(description="What visits have in common.")
    rule: ChangeRuleSettings = Field(description="When a quantity has changed.")
    exact: ExactSettings = Field(description="The effort, as for a recording with twice the parameters.")


class RatioHyperpriorSettings(Settings):
    """Bounded log-Gaussian hyperpriors of what has changed between two visits, each of every parameter."""

    median: ParameterPrior = Field(
        description="Prior of the ratio of later to earlier, of the middle person. Chosen: half as much "
        "again, or two thirds, at one standard deviation; bounds at four. That is beyond what drugs, "
        "exercise or a valve do to a heart."
    )
    spread: ParameterPrior = Field(
        description="Prior of the standard deviation of the log ratio between persons. It is what varies "
        "from day to day in each, and how differently they respond. Nothing is known of it: from 4 to 40 "
        "% at two standard deviations (chosen). Of fewer than 3 % recycled draws could not tell."
    )
    group_factor: ParameterPrior = Field(
        description="Prior of a group's ratio over that of the first group. Chosen, as the median."
    )


class ChangeGroupsSettings(Settings):
    """What has changed in groups of persons; outliers and effort are those of the posterior of a cohort."""

    draws: int = Field(
        ge=50,
        description="Draws recycled of each person's joint posterior. All that are kept: few of them lie "
        "where a narrow population does.",
    )
    least_effective: float = Field(
        gt=1.0,
        description="Effective ones of these under the population. As in cohort_posterior; a person with "
        "fewer is named, since no ratio is drawn anew.",
    )
    hyperprior: RatioHyperpriorSettings = Field(description="Priors of the ratios.")
