"""Settings of the posterior of a cohort: hyperpriors, outliers, recycled draws."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from swesbi.base.settings import Settings
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import ParameterPrior
from swesbi.verdict.verdict import Status

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
        """Return the probability of a verdict on speeds; an uninformative recording contradicts nothing.

        Raises:
            ValueError: There is no such verdict.
        """
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
