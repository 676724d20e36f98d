"""Settings of prior support, of the misspecification tests and of the verdict."""

from __future__ import annotations

from statistics import NormalDist
from typing import Annotated, Final, Self

from pydantic import Field, model_validator

from swesbi.base.settings import Settings
from swesbi.context import CONTEXT_NAMES

Positive = Annotated[float, Field(gt=0)]
Level = Annotated[float, Field(gt=0, lt=0.5)]
LEAST_TAIL_RECORDINGS: Final = 10


def strained_abs_z(level: float, tests: int) -> float:
    """Return how many standard deviations strain: normal, two-sided, so many tests together (Bonferroni)."""
    return NormalDist().inv_cdf(1.0 - level / (2.0 * tests))


class VolumeSettings(Settings):
    """How far predicted volumes, which nobody fitted, may lie from the measured ones."""

    lvedv_tolerance_fraction: Positive = Field(description="sd of measured LVEDV, over LVEDV")
    lvesv_tolerance_fraction: Positive = Field(description="sd of measured LVESV, over LVESV")
    wall_fraction: float = Field(
        gt=0, le=0.2, description="sd of the thickness that stands for the whole wall, over the septum's"
    )
    strained_level: Level = Field(description="false-alarm rate of both volumes together")
    unsupported_abs_z: Positive = Field(description="beyond it the subject is unsupported")

    @property
    def strained_abs_z(self) -> float:
        """Standard deviations beyond which a volume strains the subject: normal, two-sided, Bonferroni."""
        return strained_abs_z(self.strained_level, tests=2)

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if self.strained_abs_z >= self.unsupported_abs_z:
            raise ValueError(
                f"strained_level = {self.strained_level:g} strains beyond {self.strained_abs_z:.3g} standard "
                f"deviations, which must be below unsupported_abs_z = {self.unsupported_abs_z:g}"
            )
        return self


class EjectionTimeSettings(Settings):
    """How far the predicted ejection time may lie from the measured one, where there is one."""

    model_sd_ms: Positive = Field(description="sd of the model's own error in it")
    strained_level: Level = Field(description="false-alarm rate")

    @property
    def strained_abs_z(self) -> float:
        """Standard deviations beyond which it strains the subject."""
        return strained_abs_z(self.strained_level, tests=1)


class ContextCheckSettings(Settings):
    """When a subject's context is strange: beside the other subjects', and by declared ranges."""

    level: Level = Field(description="of the leave-one-subject-out test, over all values together")
    ranges: dict[str, tuple[float, float]] = Field(description="context value -> declared range, in its unit")

    @model_validator(mode="after")
    def _check_ranges(self) -> Self:
        for name, (low, high) in self.ranges.items():
            if name not in CONTEXT_NAMES:
                raise ValueError(f"ranges names {name!r}; known: {', '.join(CONTEXT_NAMES)}")
            if not low < high:
                raise ValueError(f"ranges.{name} = [{low:g}, {high:g}] holds nothing")
        return self


class SyntheticSettings(Settings):
    """How many recordings make the null distributions and measure the power, and how each is inferred."""

    reference_recordings: int = Field(ge=100, description="prior predictive recordings of the feature space")
    null_recordings: int = Field(ge=20, description="well-specified recordings with a posterior, a subject")
    fresh_recordings: int = Field(ge=1, description="further ones, of each kind, to count false alarms on")
    volunteer_recordings: int = Field(ge=1, description="recordings of each virtual volunteer, for the power")
    effective_draws: int = Field(ge=20, description="effective draws of each of these recordings")
    strip_fraction: float = Field(gt=0, lt=0.5, description="width of the strip at a bound, over the box's")


class RuleSettings(Settings):
    """The tests' own choices and the levels of the verdict."""

    neighbours: int = Field(ge=1, description="k of the nearest-neighbour distance")
    whitened_variance: float = Field(gt=0, lt=1, description="share of the features' variance kept")
    tail_fraction: float = Field(gt=0, le=0.5, description="share of a null fitted by a Pareto tail")
    strained_level: Level = Field(description="false-alarm rate of 'strained' or worse, over all tests")
    unsupported_level: Level = Field(description="false-alarm rate of 'unsupported', over all tests")
    volumes: VolumeSettings
    context: ContextCheckSettings

    @model_validator(mode="after")
    def _check_levels(self) -> Self:
        if self.unsupported_level >= self.strained_level:
            raise ValueError(
                f"unsupported_level = {self.unsupported_level:g} must be below "
                f"strained_level = {self.strained_level:g}"
            )
        return self


class MisspecificationSettings(Settings):
    """The misspecification tests of an experiment on measured speeds."""

    synthetic: SyntheticSettings
    rule: RuleSettings
    ejection_time: EjectionTimeSettings

    @model_validator(mode="after")
    def _check_tail(self) -> Self:
        recordings, fraction = self.synthetic.null_recordings, self.rule.tail_fraction
        if recordings * fraction < LEAST_TAIL_RECORDINGS:
            raise ValueError(
                f"synthetic.null_recordings = {recordings} times rule.tail_fraction = {fraction:g} leaves "
                f"fewer than {LEAST_TAIL_RECORDINGS} recordings to fit a tail to; raise one of them"
            )
        return self


class SupportSettings(Settings):
    """The two criteria of prior support (paper, Sec. 2.5)."""

    max_abs_z: float = Field(gt=0.0, description="largest admitted |z_obs,j| of the conditioning vector")
    min_in_prior_draws: int = Field(ge=1, description="least number of candidates within the prior's bounds")
    candidate_draws: int = Field(ge=1, description="draws from the estimator, not filtered")

    @model_validator(mode="after")
    def _check_attainable(self) -> Self:
        if self.min_in_prior_draws > self.candidate_draws:
            raise ValueError(
                f"min_in_prior_draws = {self.min_in_prior_draws} cannot be met by "
                f"candidate_draws = {self.candidate_draws}; lower the first or raise the second"
            )
        return self


class UninformativeSettings(Settings):
    """When a recording has left a quantity as the prior has it."""

    sd_ratio: float = Field(
        gt=0, le=1, description="posterior over prior sd of a log, from which on it may be as the prior's"
    )
    shift: Positive = Field(
        description="largest shift of the median of a log, over its prior sd, that leaves it as the prior's"
    )
