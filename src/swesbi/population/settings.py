"""Settings of a population: who its contexts are, how they are recorded, and what is done with them.

The prior of contexts has groups, of ages or of a disease, and by sex the distributions of body and heart.
Within a group and a sex, log BSA, log HR, log LVEDV, log IVSd and logit EF are jointly normal. Their medians
follow age; those of LVEDV and IVSd follow BSA besides.
"""

from __future__ import annotations

from typing import Annotated, Final, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from swesbi.base.settings import Settings
from swesbi.context import CONTEXT_RANGES, RELATIVE_THICKNESS_RANGE, Context, outside, wall_in_words

DECLARED_NAMES: Final = tuple(CONTEXT_RANGES)
"""What of the context enters the simulator (paper, Eq. 2)."""
MOST_SHOWN: Final = 32
"""Subjects of a cohort that still have figures and a row on the page each; larger ones are counted."""
Positive = Annotated[float, Field(gt=0.0)]
Row = Annotated[tuple[float, ...], Field(min_length=5, max_length=5)]


def _ascending(limits: tuple[float, float]) -> tuple[float, float]:
    if not limits[0] < limits[1]:
        raise ValueError(f"a range needs low < high, got [{limits[0]:g}, {limits[1]:g}]")
    return limits


Range = Annotated[
    tuple[Positive, Positive],
    AfterValidator(_ascending),
    Field(json_schema_extra={"allowed": "[low, high] with 0 < low < high"}),
]


class AgeCurve(Settings):
    """A median that follows age: given at some ages, its logarithm is linear between, constant beyond."""

    age_years: tuple[Positive, ...] = Field(min_length=1, description="Ascending ages of the medians.")
    median: tuple[Positive, ...] = Field(
        min_length=1, description="Median at each age.", json_schema_extra={"unit": "of its key"}
    )

    @model_validator(mode="after")
    def _check_knots(self) -> Self:
        if len(self.age_years) != len(self.median):
            raise ValueError(f"{len(self.age_years)} ages, but {len(self.median)} medians")
        if any(np.diff(self.age_years) <= 0):
            raise ValueError(f"ages must ascend, got {list(self.age_years)}")
        return self


class Quantity(AgeCurve):
    """A log-normal quantity."""

    log_sd: float = Field(gt=0, lt=1, description="Standard deviation of its logarithm, at a given age.")


class SizedQuantity(Quantity):
    """A log-normal quantity whose median also grows with a power of body surface area."""

    at_bsa_m2: Positive = Field(description="Body surface area at which the medians hold.")
    bsa_exponent: float = Field(ge=0, le=3, description="Exponent of BSA / at_bsa_m2.")


class Fraction(AgeCurve):
    """A logit-normal fraction."""

    logit_sd: float = Field(gt=0, lt=2, description="Standard deviation of its logit, at a given age.")

    @model_validator(mode="after")
    def _check_fraction(self) -> Self:
        if max(self.median) >= 1.0:
            raise ValueError(f"fractions must be below 1, got {list(self.median)}")
        return self


class BodySettings(Settings):
    """Body and heart of one sex within a group.

    Groups of disease have the BSA of adults; `hypertrophied` has their heart rate too.
    """

    bsa_m2: Quantity = Field(description="Body surface area.")
    hr_bpm: Quantity = Field(description="Heart rate.")
    lvedv_ml: SizedQuantity = Field(description="Left ventricular end-diastolic volume.")
    ivsd_cm: SizedQuantity = Field(description="End-diastolic thickness of the septum.")
    ejection_fraction: Fraction = Field(description="Ejection fraction.")


class GroupSettings(Settings):
    """One group, of ages or of a disease; the sexes have equal shares, ages are uniform."""

    share: float = Field(
        gt=0,
        le=1,
        description="Share of the population. Chosen: with the other shares, each stratum of calibration "
        "contains a fifth of the recordings.",
    )
    age_years: Range = Field(
        description="Ages, uniform between, so that each age is learnt as well. Chosen. Of children: "
        "younger hearts fall below the declared LVEDV."
    )
    female: BodySettings = Field(description="Body and heart of women and girls.")
    male: BodySettings = Field(description="Body and heart of men and boys.")
    correlation: tuple[Row, Row, Row, Row, Row] = Field(
        description="Correlation of log BSA, log HR, log LVEDV, log IVSd and logit EF at a given age. "
        "Those of LVEDV and IVSd are beyond their growth with BSA."
    )

    @model_validator(mode="after")
    def _check_correlation(self) -> Self:
        matrix = np.array(self.correlation)
        if not (np.array_equal(matrix, matrix.T) and np.array_equal(np.diag(matrix), np.ones(5))):
            raise ValueError("the correlation matrix must be symmetric with ones on its diagonal")
        if np.linalg.eigvalsh(matrix)[0] <= 0.0:
            raise ValueError("the correlation matrix must be positive definite; weaken its correlations")
        return self

    def body(self, sex: Literal["F", "M"]) -> BodySettings:
        """Return the body and heart of one sex."""
        return self.male if sex == "M" else self.female


class DeclaredRange(Settings):
    """Hard limits of what enters the simulator; a network trained on the population refuses outside.

    Chosen: each holds more than the central 95 % of every group.
    """

    hr_bpm: Range = Field(description="Heart rate. Chosen.")
    lvedv_ml: Range = Field(description="Left ventricular end-diastolic volume. Chosen.")
    ivsd_cm: Range = Field(description="End-diastolic thickness of the septum. Chosen.")
    relative_thickness: Range = Field(
        description="Septal thickness over the radius of a sphere of volume LVEDV, what both allow "
        "together. Chosen: thinner walls eject next to nothing at any LVEDV of the "
        "range. Thicker ones leave less than half of LVEDV for the cavity."
    )

    @model_validator(mode="after")
    def _within_the_model(self) -> Self:
        ranges = CONTEXT_RANGES | {"relative_thickness": RELATIVE_THICKNESS_RANGE}
        for name, (lowest, highest) in ranges.items():
            low, high = self.limits(name)
            if low < lowest or high > highest:
                raise ValueError(
                    f"{name}: [{low:g}, {high:g}] exceeds [{lowest:g}, {highest:g}], the limits of the model"
                )
        return self

    def limits(self, name: str) -> tuple[float, float]:
        """Return the limits of one of ``DECLARED_NAMES``, or of the relative thickness."""
        limits: tuple[float, float] = getattr(self, name)
        return limits


class PopulationSettings(Settings):
    """Who the network is trained for: groups, the declared range, and how much is trained on beyond.

    Sources of the groups: Lang 2015: Lang et al., J Am Soc Echocardiogr 2015;28:1-39 (two-dimensional,
    biplane; mean +- SD, normal = mean +- 2 SD). Ostchega 2011: Ostchega et al., Natl Health Stat Report
    2011;41 (NHANES 1999-2008). Sacco 2010: Sacco et al., PLoS ONE 2010;5:e8933. CDC 2000: growth charts
    of the United States (median height and weight, BSA by Mosteller). Fleming 2011: Fleming et al.,
    Lancet 2011;377:1011-1018. Lopez 2017: Lopez et al., Circ Cardiovasc Imaging 2017;10:e006979.
    Buechel 2009: Buechel et al., J Cardiovasc Magn Reson 2009;11:19. Robbers-Visser 2009:
    Robbers-Visser et al., J Magn Reson Imaging 2009;29:552-559. Chuang 2014: Chuang et al., J Magn
    Reson Imaging 2014;39:895-900 (Framingham). ESC 2014: Elliott et al., Eur Heart J 2014;35:2733-2779.
    """

    groups: dict[str, GroupSettings] = Field(
        min_length=1,
        description="Groups by name; shares sum to one. `adults` and `children` are of health. "
        "`hypertrophied` has septa of 1.1 to 2.0 cm, from hypertension to hypertrophic cardiomyopathy. "
        "`dilated` has an LVEDV of 150 to 300 mL with a low ejection fraction, as in dilated "
        "cardiomyopathy.",
    )
    declared_range: DeclaredRange = Field(description="Outside which the network refuses.")
    broad_share: float = Field(
        ge=0,
        lt=1,
        description="Share of the contexts trained on whose HR, LVEDV and IVSd are uniform in their "
        "logarithm over the declared range. Chosen: the edges of the declared range are trained on, the "
        "population remains the larger part.",
    )

    @model_validator(mode="after")
    def _check_shares(self) -> Self:
        total = sum(group.share for group in self.groups.values())
        if abs(total - 1.0) > 1e-9:
            raise ValueError(f"the shares of the groups sum to {total:g}, they must sum to 1")
        return self


def of_group(population: PopulationSettings, name: str) -> PopulationSettings:
    """Return the population of which one group is all."""
    group = population.groups.get(name)
    if group is None:
        raise ValueError(f"the population has no group {name!r}; it has {', '.join(population.groups)}")
    whole = {name: group.model_copy(update={"share": 1.0})}
    return population.model_copy(update={"groups": whole})


class PopulationSizes(Settings):
    """How many simulations the network learns from."""

    contexts: int = Field(
        ge=10,
        description="Contexts drawn from the population. Chosen: half a minute of simulations; the "
        "network knows hearts between them.",
    )
    draws_per_context: int = Field(ge=1, description="Draws of the prior of theta in each. Chosen likewise.")


def _spread(limits: tuple[float, float]) -> tuple[float, float]:
    low, high = limits
    if not 0.0 < low < high < 1.0:
        raise ValueError(f"relative_se = [{low:g}, {high:g}]: need 0 < low < high < 1")
    return limits


Errors = Annotated[
    tuple[float, float],
    AfterValidator(_spread),
    Field(json_schema_extra={"allowed": "[low, high] with 0 < low < high < 1"}),
]


class FreeConditionSettings(Settings):
    """Recordings without gating that the network learns from: sets of pushes at any instants."""

    share: float = Field(ge=0.0, lt=1.0, description="Share of all recordings; the rest are gated. Chosen.")
    pushes: tuple[int, int] = Field(
        description="Fewest and most accepted pushes; uniform in the logarithm. Chosen: from two to two "
        "beats of 34 pushes a second, most accepted."
    )
    relative_se: Errors = Field(
        description="Standard error of a push over its speed; uniform in its log. Chosen: beyond what "
        "laboratories declare on either side."
    )
    spread_log_sd: float = Field(
        ge=0.0,
        lt=1.0,
        description="Standard deviation of its logarithm within a recording. Chosen: fits are of unequal "
        "quality.",
    )
    least_window: float = Field(
        gt=0.0,
        le=1.0,
        description="Half of them lie in one part of the cycle, at least so wide. Chosen: systole alone, "
        "or late diastole alone.",
        json_schema_extra={"unit": "cycle"},
    )
    most_errors_log_sd: float = Field(
        ge=0.0,
        le=1.0,
        description="Half of them have declared errors, times a factor whose log has a prior sd up to "
        "this. Chosen: errors known to a factor of 1.6 either way, or better.",
    )

    @model_validator(mode="after")
    def _check_pushes(self) -> Self:
        fewest, most = self.pushes
        if not 2 <= fewest < most:
            raise ValueError(f"pushes = [{fewest}, {most}]: need 2 <= fewest < most")
        return self


class ConditionSettings(Settings):
    """Noise levels and missing phases of the recordings that the network learns from."""

    relative_se: Errors = Field(
        description="Standard error of the mean speed of a phase without failed samples; uniform in its "
        "log. Chosen: half to twice the cohort's, 2.2 %, and a little more."
    )
    missing_fraction: float = Field(
        ge=0.0,
        lt=1.0,
        description="Phases are missed at random, at a rate uniform up to this. Chosen: recordings with "
        "up to four missing phases, the most that is admitted, are common.",
    )
    free_running: FreeConditionSettings = Field(
        description="Sets of pushes at any instants; the same network takes both."
    )

    @property
    def seen_relative_se(self) -> tuple[float, float]:
        """Standard errors of what is seen in one cell, where several pushes may lie."""
        (low, high), free = self.relative_se, self.free_running
        return min(low, free.relative_se[0] / free.pushes[1] ** 0.5), max(high, free.relative_se[1])


class StrataSettings(Settings):
    """Where continuous values are cut into strata; sex makes two of its own.

    Each stratum contains 100 recordings or more: coverage of 90 % to 6.0 points. In `make full` it has
    400: to 3.0 points.
    """

    age_years: tuple[float, ...] = Field(
        min_length=1, description="Ascending cuts of age. Children, and thirds of the adults."
    )
    hr_bpm: tuple[float, ...] = Field(min_length=1, description="Ascending cuts of heart rate. About thirds.")
    lvedv_ml: tuple[float, ...] = Field(
        min_length=1, description="Ascending cuts of LVEDV. Small, usual, dilated."
    )
    ivsd_cm: tuple[float, ...] = Field(
        min_length=1, description="Ascending cuts of the septum. Thin, usual, hypertrophied."
    )
    relative_se: tuple[float, ...] = Field(
        min_length=1,
        description="Ascending cuts of the standard error of a phase without failed samples. Thirds of "
        "the logarithm.",
    )


class NullSettings(Settings):
    """Sizes of the null distributions."""

    recordings: int = Field(
        ge=50,
        description="Gated null recordings, each of a heart of its own. Chosen: the level of a test is known "
        "to half a point.",
    )
    free_running_recordings: int = Field(
        ge=50,
        description="Free-running null recordings likewise. Chosen: a thousand with known and with declared "
        "errors each.",
    )
    effective_draws: int = Field(
        ge=20, description="Effective draws of each. Chosen: posterior masses to 5 points."
    )


def in_declared_range(context: Context, population: PopulationSettings) -> tuple[str, ...]:
    """Say what of a context is outside the declared range, with its limits; empty if nothing is."""
    declared = population.declared_range
    problems = outside(vars(context), {name: declared.limits(name) for name in DECLARED_NAMES})
    low, high = declared.relative_thickness
    if not low <= context.relative_thickness <= high:
        problems.append(f"{wall_in_words(context)}, outside [{low:g}, {high:g}]")
    return tuple(problems)
