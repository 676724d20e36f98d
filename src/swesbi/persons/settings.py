"""Settings of persons and groups: two visits of one person, the posterior of a cohort, planned studies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Final, Literal, Self, cast

import numpy as np
from pydantic import Field, model_validator

from swesbi.base.arrays import FloatArray
from swesbi.base.settings import Level, Settings
from swesbi.parameters import ParameterPrior
from swesbi.posterior.settings import ExactSettings
from swesbi.verdict.verdict import Status


def _share(of: str, why: str = "the organ is the same") -> float:
    """Return the field of a share, which pydantic takes in place of a value."""
    described = f"Share of the {of}. Chosen: {why}."
    return cast("float", Field(ge=0.0, lt=1.0, json_schema_extra={"unit": "1"}, description=described))


class SharesSettings(Settings):
    """What two visits of one person have in common; every other parameter is each visit's own.

    Of a parameter it is the correlation of its normal scores: 0 makes the visits strangers in it, and the
    nearer it is to 1, the closer are both values. Of the discrepancy it is the share of its variance that is
    the same at the same phase.

    Each visit's own are theta, the passive stiffness, loading (R_d, R_d C_s, the stressed volume), onset
    and duration of activation. There are no repeated measurements of any. Chosen: .9 of an organ that
    is the same. Visits of one person so make a tenth of the variance over persons and visits. What the
    investigator sets anew has .8.
    """

    activation_ramp_s: float = _share("width of the ramps of activation")
    destruction_alpha: float = _share("bonds destroyed per unit of strain")
    sigma_0_pa: float = _share("stress of the fully activated fibre")
    passive_wall_factor: float = _share("factor of the passive wall's moduli")
    length_dependence: float = _share("length dependence of the bonds")
    passive_ratio: float = _share("ratio of the passive stiffness at both ends")
    passive_middle_factor: float = _share("factor of the passive stiffness between")
    speed_scale: float = _share(
        "scale of all speeds", "plate thickness and dispersion stay, the angle to the fibres is set anew"
    )
    discrepancy: float = Field(
        ge=0.0,
        le=1.0,
        json_schema_extra={"unit": "1"},
        description="Share of the variance of the discrepancy, at the same phase. Chosen: equations that "
        "miss a heart miss it again.",
    )

    def of(self, names: Sequence[str]) -> FloatArray:
        """Return the share of each of these parameters, 0 where it is the visit's own; shape (d,)."""
        return np.array([getattr(self, name, 0.0) for name in names])


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


Probability = Annotated[float, Field(ge=0.0, lt=1.0)]


class HyperpriorSettings(Settings):
    """Bounded log-Gaussian hyperpriors, each of every parameter; medians have the prior of theta itself."""

    spread: ParameterPrior = Field(
        description="Prior of the standard deviation of log theta between subjects. Passive moduli of "
        "healthy hearts differ by a quarter and more (Genet et al., J Appl Physiol 2014;117:142). Of "
        "active parameters nothing is known: from 9 % to a factor of 2.6 at two standard deviations "
        "(chosen)."
    )
    age_factor: ParameterPrior = Field(
        description="Prior of a parameter's factor per ten years. Chosen: a doubling over an adult's "
        "seventy years at one standard deviation, bounds at four."
    )
    sex_factor: ParameterPrior = Field(
        description="Prior of a parameter's factor, male over female. Chosen: 35 % between the sexes at "
        "one standard deviation, bounds at four."
    )
    heart_rate_factor: ParameterPrior = Field(
        description="Prior of its factor per ten beats per minute. Chosen: 15 % at one standard "
        "deviation, bounds at four. Rates rise with heart rate, by how much at rest is not known."
    )
    group_factor: ParameterPrior = Field(
        description="Prior of a group's factor against the first group. Chosen: 50 % between groups at "
        "one standard deviation, bounds at four."
    )


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


class OutlierSettings(Settings):
    """Probability that a subject is none of the population, by verdict.

    Such a subject's own answer stays as it is, and says nothing of the others.
    """

    not_contradicted: Probability = Field(
        description="Probability of a subject whose recording nothing contradicts. Chosen: one of twenty "
        "may be of another kind of heart."
    )
    doubtful: Probability = Field(
        description="Probability of one whose recording is doubtful. Chosen between the two others."
    )
    contradicted: Probability = Field(
        description="Probability of one whose recording the model cannot have made. Chosen: nearly every "
        "one is of another kind of heart."
    )

    def of(self, status: str) -> float:
        """Return the probability of a verdict on speeds; an uninformative recording contradicts nothing."""
        by_verdict = {
            Status.NOT_CONTRADICTED: self.not_contradicted,
            Status.UNINFORMATIVE: self.not_contradicted,
            Status.DOUBTFUL: self.doubtful,
            Status.CONTRADICTED: self.contradicted,
        }
        if status not in by_verdict:
            raise ValueError(f"verdict {str(status)!r}: expected one of {', '.join(by_verdict)}")
        return by_verdict[Status(status)]


class HierarchySettings(Settings):
    """The posterior of the population, and what is recycled of each subject's own.

    It gives medians, spreads, slopes, groups and every subject within them, of each experiment with
    exact posteriors.
    """

    draws: int = Field(
        ge=50,
        description="Draws recycled of each subject's posterior. Chosen: log evidence of a subject under "
        "a population to 0.1 and better.",
    )
    rough_draws: int = Field(
        ge=20,
        description="Of these, for the first proposal of large cohorts. Chosen: the posterior itself "
        "takes all.",
    )
    least_effective: float = Field(
        gt=1.0,
        description="Effective ones of these under the population; a subject with fewer is drawn anew "
        "near it. Chosen.",
    )
    refreshes: int = Field(
        ge=0, description="Rounds of drawing anew, at most. Chosen: one is enough as a rule."
    )
    shown_draws: int = Field(
        ge=100,
        description="Draws of the population's posterior that are stored. Chosen: limits to 3 % of the "
        "posterior sd.",
    )
    reference_group: str = Field(
        description="Group that the others are compared with; empty: that of the first subject."
    )
    outliers: OutlierSettings = Field(description="How likely a subject is none of the population.")
    hyperprior: HyperpriorSettings = Field(description="Priors of medians, spreads and factors.")
    exact: ExactSettings = Field(
        description="The effort, as for a recording and cheaper, since there is no simulation."
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


Spread = Annotated[float, Field(ge=0.0, lt=0.5)]
Design = Literal["paired", "groups"]
PAIRED: Final = "paired"
"""Two visits of each person."""
GROUPS: Final = "groups"
"""One visit of each person of two groups."""


class PlannedPersonsSettings(Settings):
    """The persons of a bank; spreads are standard deviations of logarithms.

    Persons are drawn as those of data/virtual_trial are. Changes from visit to visit are chosen as
    there, for lack of repeated measurements of any. Theta and passive stiffness vary little within a week.
    """

    number: int = Field(
        ge=4,
        description="Persons of a bank, from which studies are drawn. Chosen: power of one number of "
        "persons to about 5 points, a bank's own luck included (docs/compare-and-plan.md).",
    )
    group: str = Field(description="Group of the population whose contexts they have. Chosen.")
    prior_share: float = Field(
        gt=0.0,
        le=1.0,
        description="Spread of theta and passive stiffness between persons, over the prior's. Chosen, as in "
        "data/virtual_trial: half of it, since the prior holds all hearts that may come.",
    )
    visit_spread: Spread = Field(
        description="Spread of each of theta from visit to visit of a person. Chosen."
    )
    response_spread: Spread = Field(
        description="Spread of the effect between persons. Chosen: two thirds of persons respond within "
        "10 % of the middle one."
    )
    passive_spread: Spread = Field(description="Spread of the passive stiffness from visit to visit. Chosen.")
    loading_spread: Spread = Field(
        description="Spread of R_d, and of the time constant, from visit to visit. Chosen: resistance and "
        "time constant of the arteries vary more."
    )
    heart_rate_spread: Spread = Field(
        description="Spread of the resting heart rate from visit to visit. Chosen."
    )
    kept_scale_share: float = Field(
        ge=0.0,
        le=1.0,
        description="Share of the variance of the log scale of speeds that a person keeps. As in "
        "data/virtual_trial.",
    )
    weeks_between: float = Field(
        gt=0.0,
        description="Weeks between the visits. As in data/virtual_trial; only the age depends on it.",
        json_schema_extra={"unit": "weeks"},
    )
    ejection_fraction: tuple[float, float] = Field(
        description="Ejection fraction at the first visit, of who takes part. That of health (Lang 2015)."
    )


class PlannedStudiesSettings(Settings):
    """The simulated studies of a bank."""

    sizes: tuple[Annotated[int, Field(ge=2)], ...] = Field(
        min_length=3,
        description="Numbers of persons that are tried, of each group where there are two. Chosen.",
    )
    studies: int = Field(
        ge=20,
        description="Studies of each number of persons, with the effect and without. Chosen: power to 1.3 "
        "points but for the bank's luck.",
    )
    resamples: int = Field(
        ge=4,
        description="Resamples of the bank, for the Monte Carlo error of a bank of its size. Chosen: that "
        "luck to a tenth of itself.",
    )

    @model_validator(mode="after")
    def _check_sizes(self) -> Self:
        if list(self.sizes) != sorted(set(self.sizes)):
            raise ValueError(f"sizes = {list(self.sizes)}: list them in ascending order, each once")
        return self


class PlanSettings(Settings):
    """Planned studies: persons, studies, and when an effect counts as found."""

    persons: PlannedPersonsSettings = Field(description="Persons of a bank.")
    studies: PlannedStudiesSettings = Field(description="Simulated studies.")
    probability: Level = Field(
        description="Probability of an effect in its direction, above which a study finds it. It is the "
        "one-sided level of .05 of most protocols."
    )
    power: Level = Field(
        description="Share of studies that are to find it, unless another is asked for. As studies are "
        "planned."
    )
