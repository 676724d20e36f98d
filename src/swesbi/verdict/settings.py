"""Settings of prior support, of the misspecification tests and of the verdict."""

from __future__ import annotations

from pathlib import Path
from statistics import NormalDist
from typing import Annotated, Final, Self

from pydantic import Field, model_validator

from swesbi.base.settings import Settings

SHIPPED_NULLS: Final = Path(__file__).with_name("nulls.h5")
"""Null recordings that come with the package; `tools.shipped` makes the file."""
Positive = Annotated[float, Field(gt=0)]
Level = Annotated[float, Field(gt=0, lt=0.5)]


def doubtful_abs_z(level: float, tests: int) -> float:
    """Return how many standard deviations one of the tests may lie off: normal, two-sided (Bonferroni)."""
    return NormalDist().inv_cdf(1.0 - level / (2.0 * tests))


class VolumeSettings(Settings):
    """How far predicted volumes, which nobody fitted, may lie from the measured ones.

    The prior says nothing of their error, so tolerances are stated. Repeatability by two-dimensional
    echocardiography is 15 % of LVEDV and 25 % of LVESV, as 95 % limits (Gordon et al., J Am Coll Cardiol
    1983;2:506-513). These are standard deviations of 7.7 and 12.8 %.
    """

    lvedv_tolerance_fraction: Positive = Field(
        description="Standard deviation of measured LVEDV, over LVEDV. Chosen above repeatability: "
        "methods disagree besides, by more in LVEDV."
    )
    lvesv_tolerance_fraction: Positive = Field(
        description="Standard deviation of measured LVESV, over LVESV. Chosen above repeatability."
    )
    wall_fraction: float = Field(
        gt=0,
        le=0.2,
        description="Standard deviation of the thickness that stands for the whole wall, over the "
        "septum's. Thickness is measured to 9 %, 95 % limits (Am Heart J 1988;115:425-431).",
    )
    doubtful_level: Level = Field(
        description="False-alarm rate of both volumes together. Chosen: 3.0 standard deviations each."
    )
    contradicted_abs_z: Positive = Field(
        description="Standard deviations beyond which the model is contradicted. Chosen: no measurement "
        "explains it."
    )

    @property
    def doubtful_abs_z(self) -> float:
        """Standard deviations beyond which a volume makes the subject doubtful: two-sided, Bonferroni."""
        return doubtful_abs_z(self.doubtful_level, tests=2)

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if self.doubtful_abs_z >= self.contradicted_abs_z:
            raise ValueError(
                f"doubtful_level = {self.doubtful_level:g} begins at {self.doubtful_abs_z:.3g} standard "
                f"deviations, which must be below contradicted_abs_z = {self.contradicted_abs_z:g}"
            )
        return self


class EjectionTimeSettings(Settings):
    """How far the predicted ejection time may lie from the measured one, where there is one.

    Nobody fitted it.
    """

    model_sd_ms: Positive = Field(
        description="Standard deviation of the model's own error in it. Other structures of the heart "
        "move it at given parameters, as root mean square over the volunteers' contexts. Length "
        "dependence moves it by 20 ms, the second Piola stress by 14, alpha = 4 by 18. A thin wall moves "
        "it by 4, inertance by 2; together 13.5, rounded up."
    )
    doubtful_level: Level = Field(description="False-alarm rate. Chosen: 2.6 standard deviations.")

    @property
    def doubtful_abs_z(self) -> float:
        """Standard deviations beyond which it makes the subject doubtful."""
        return doubtful_abs_z(self.doubtful_level, tests=1)


class RuleSettings(Settings):
    """The tests' own choices and the levels of the verdict."""

    tail_fraction: float = Field(
        gt=0,
        le=0.5,
        description="Share of a null fitted by a Pareto tail. Chosen: exceedances are fitted as by "
        "Knijnenburg et al. 2009.",
    )
    doubtful_level: Level = Field(
        description="False-alarm rate of 'doubtful' or worse, over both tests with a null distribution "
        "together. Chosen: volumes, context and noise take the rest of 5 %."
    )
    contradicted_level: Level = Field(
        description="False-alarm rate of 'contradicted', over all tests. Chosen."
    )
    volumes: VolumeSettings = Field(description="The test of the volumes of the cavity.")
    context_level: Level = Field(
        description="Level of the test of a context beside the others', all values together. Chosen as of "
        "the volumes."
    )

    @model_validator(mode="after")
    def _check_levels(self) -> Self:
        if self.contradicted_level >= self.doubtful_level:
            raise ValueError(
                f"contradicted_level = {self.contradicted_level:g} must be below "
                f"doubtful_level = {self.doubtful_level:g}"
            )
        return self


class MisspecificationSettings(Settings):
    """The misspecification tests of an experiment on measured speeds."""

    rule: RuleSettings = Field(description="The tests and the levels of the verdict.")
    ejection_time: EjectionTimeSettings = Field(
        description="The test of the ejection time, of subjects with lvet_ms."
    )


class SupportSettings(Settings):
    """The two criteria of prior support (paper, Sec. 2.5)."""

    max_abs_z: float = Field(
        gt=0.0, description="Largest admitted |z_obs,j| of the conditioning vector. Paper, Sec. 2.5."
    )
    min_in_prior_draws: int = Field(
        ge=1, description="Least number of candidates within the prior's bounds. Paper, Sec. 2.5."
    )
    candidate_draws: int = Field(ge=1, description="Draws from the estimator, not filtered. Paper, Sec. 2.5.")

    @model_validator(mode="after")
    def _check_attainable(self) -> Self:
        if self.min_in_prior_draws > self.candidate_draws:
            raise ValueError(
                f"min_in_prior_draws = {self.min_in_prior_draws} cannot be met by "
                f"candidate_draws = {self.candidate_draws}; lower the first or raise the second"
            )
        return self


class UninformativeSettings(Settings):
    """When a recording has left a quantity as the prior has it.

    A recording that leaves every quantity so, and fits, is called uninformative.
    """

    sd_ratio: float = Field(
        gt=0,
        le=1,
        description="Posterior over prior sd of a log, from which on it may be as the prior's. Chosen: "
        "narrower by a tenth is several times what a thousand effective draws leave uncertain.",
    )
    shift: Positive = Field(
        description="Largest shift of the median of a log, over its prior sd, that leaves it as the "
        "prior's. Chosen: a quarter of the prior's standard deviation."
    )
