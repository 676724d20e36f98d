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
from swesbi.context import CONTEXT_RANGES, RELATIVE_THICKNESS_RANGE, Context, wall_in_words

QUANTITIES: Final = ("bsa_m2", "hr_bpm", "lvedv_ml", "ivsd_cm", "ejection_fraction")
"""What is drawn for one person of known age, in the order of the correlation matrices."""
DECLARED_NAMES: Final = ("hr_bpm", "lvedv_ml", "ivsd_cm")
"""What of the context enters the simulator (paper, Eq. 2)."""
MOST_SHOWN: Final = 32
"""Subjects of a cohort that still have figures and a row on the page each; larger ones are counted."""
Positive = Annotated[float, Field(gt=0.0)]
Row = Annotated[tuple[float, ...], Field(min_length=5, max_length=5)]


def _ascending(limits: tuple[float, float]) -> tuple[float, float]:
    if not limits[0] < limits[1]:
        raise ValueError(f"a range needs low < high, got [{limits[0]:g}, {limits[1]:g}]")
    return limits


Range = Annotated[tuple[Positive, Positive], AfterValidator(_ascending)]


class AgeCurve(Settings):
    """A median that follows age: given at some ages, its logarithm is linear between, constant beyond."""

    age_years: tuple[Positive, ...] = Field(min_length=1, description="ascending ages of the medians")
    median: tuple[Positive, ...] = Field(min_length=1, description="median at each age, unit of the key")

    @model_validator(mode="after")
    def _check_knots(self) -> Self:
        if len(self.age_years) != len(self.median):
            raise ValueError(f"{len(self.age_years)} ages, but {len(self.median)} medians")
        if any(np.diff(self.age_years) <= 0):
            raise ValueError(f"ages must ascend, got {list(self.age_years)}")
        return self


class Quantity(AgeCurve):
    """A log-normal quantity."""

    log_sd: float = Field(gt=0, lt=1, description="standard deviation of its logarithm, at a given age")


class SizedQuantity(Quantity):
    """A log-normal quantity whose median also grows with a power of body surface area."""

    at_bsa_m2: Positive = Field(description="body surface area at which the medians hold")
    bsa_exponent: float = Field(ge=0, le=3, description="exponent of BSA / at_bsa_m2")


class Fraction(AgeCurve):
    """A logit-normal fraction."""

    logit_sd: float = Field(gt=0, lt=2, description="standard deviation of its logit, at a given age")

    @model_validator(mode="after")
    def _check_fraction(self) -> Self:
        if max(self.median) >= 1.0:
            raise ValueError(f"fractions must be below 1, got {list(self.median)}")
        return self


class BodySettings(Settings):
    """Body and heart of one sex within a group."""

    bsa_m2: Quantity
    hr_bpm: Quantity
    lvedv_ml: SizedQuantity
    ivsd_cm: SizedQuantity
    ejection_fraction: Fraction


class GroupSettings(Settings):
    """One group, of ages or of a disease; the sexes have equal shares, ages are uniform."""

    share: float = Field(gt=0, le=1, description="share of the population")
    age_years: Range = Field(description="ages, uniform between")
    female: BodySettings
    male: BodySettings
    correlation: tuple[Row, Row, Row, Row, Row] = Field(
        description="of log BSA, log HR, log LVEDV, log IVSd, logit EF at a given age; those of LVEDV "
        "and IVSd beyond their growth with BSA"
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
    """Hard limits of what enters the simulator; a network trained on the population refuses outside."""

    hr_bpm: Range
    lvedv_ml: Range
    ivsd_cm: Range
    relative_thickness: Range = Field(
        description="septal thickness over the radius of a sphere of volume LVEDV, what both allow together"
    )

    @model_validator(mode="after")
    def _within_the_model(self) -> Self:
        ranges = {name: CONTEXT_RANGES[name] for name in DECLARED_NAMES}
        for name, (lowest, highest) in (ranges | {"relative_thickness": RELATIVE_THICKNESS_RANGE}).items():
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
    """Who the network is trained for: groups, the declared range, and how much is trained on beyond."""

    groups: dict[str, GroupSettings] = Field(min_length=1, description="by name; shares sum to one")
    declared_range: DeclaredRange
    broad_share: float = Field(
        ge=0,
        lt=1,
        description="share of the contexts trained on whose HR, LVEDV and IVSd are uniform in their "
        "logarithm over the declared range",
    )

    @model_validator(mode="after")
    def _check_shares(self) -> Self:
        total = sum(group.share for group in self.groups.values())
        if abs(total - 1.0) > 1e-9:
            raise ValueError(f"the shares of the groups sum to {total:g}, they must sum to 1")
        return self

    def context_ranges(self) -> dict[str, tuple[float, float]]:
        """Return what a context of the population may be: the ages of its groups, and the declared range."""
        ages = [age for group in self.groups.values() for age in group.age_years]
        declared = {name: self.declared_range.limits(name) for name in DECLARED_NAMES}
        return {"age_years": (min(ages), max(ages)), **declared}


def of_group(population: PopulationSettings, name: str) -> PopulationSettings:
    """Return the population of which one group is all.

    Raises:
        ValueError: It has no such group.
    """
    group = population.groups.get(name)
    if group is None:
        raise ValueError(f"the population has no group {name!r}; it has {', '.join(population.groups)}")
    whole = {name: group.model_copy(update={"share": 1.0})}
    return population.model_copy(update={"groups": whole})


class PopulationSizes(Settings):
    """How many simulations the network learns from."""

    contexts: int = Field(ge=10, description="contexts drawn from the population")
    draws_per_context: int = Field(ge=1, description="draws of the prior of theta in each")


def _spread(limits: tuple[float, float]) -> tuple[float, float]:
    low, high = limits
    if not 0.0 < low < high < 1.0:
        raise ValueError(f"relative_se = [{low:g}, {high:g}]: need 0 < low < high < 1")
    return limits


Errors = Annotated[tuple[float, float], AfterValidator(_spread)]


class FreeConditionSettings(Settings):
    """Recordings without gating that the network learns from: sets of pushes at any instants."""

    share: float = Field(ge=0.0, lt=1.0, description="of all recordings; the rest are gated")
    pushes: tuple[int, int] = Field(description="fewest and most accepted pushes; uniform in the logarithm")
    relative_se: Errors = Field(description="standard error of a push over its speed; uniform in its log")
    spread_log_sd: float = Field(ge=0.0, lt=1.0, description="sd of its logarithm within a recording")
    least_window: float = Field(
        gt=0.0, le=1.0, description="half of them lie in one part of the cycle, at least so wide"
    )
    most_errors_log_sd: float = Field(
        ge=0.0,
        le=1.0,
        description="half of them have declared errors, times a factor whose log has a prior sd up to this",
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
        description="standard error of the mean speed of a phase without failed samples; uniform in its log"
    )
    missing_fraction: float = Field(
        ge=0.0, lt=1.0, description="phases are missed at random, at a rate uniform up to this"
    )
    free_running: FreeConditionSettings

    @property
    def seen_relative_se(self) -> tuple[float, float]:
        """Standard errors of what is seen in one cell, where several pushes may lie."""
        (low, high), free = self.relative_se, self.free_running
        return min(low, free.relative_se[0] / free.pushes[1] ** 0.5), max(high, free.relative_se[1])


class StrataSettings(Settings):
    """Where continuous values are cut into strata; sex makes two of its own."""

    age_years: tuple[float, ...] = Field(min_length=1, description="ascending cuts")
    hr_bpm: tuple[float, ...] = Field(min_length=1, description="ascending cuts")
    lvedv_ml: tuple[float, ...] = Field(min_length=1, description="ascending cuts")
    ivsd_cm: tuple[float, ...] = Field(min_length=1, description="ascending cuts")
    relative_se: tuple[float, ...] = Field(
        min_length=1, description="ascending cuts of the standard error of a phase without failed samples"
    )


class NullSettings(Settings):
    """Sizes of the null distributions."""

    recordings: int = Field(ge=50, description="fresh recordings, each of a context of its own")
    predictive_recordings: int = Field(
        ge=100, description="prior predictive recordings of a subject: for the space, and again for distances"
    )
    effective_draws: int = Field(ge=20, description="effective draws of each")
    strip_fraction: float = Field(gt=0.0, lt=0.5, description="width of the strip at a bound, over the box's")


def in_declared_range(context: Context, population: PopulationSettings) -> tuple[str, ...]:
    """Say what of a context is outside the declared range, with its limits; empty if nothing is."""
    problems = []
    for name in DECLARED_NAMES:
        value = float(getattr(context, name))
        low, high = population.declared_range.limits(name)
        if not low <= value <= high:
            problems.append(f"{name} = {value:g} is outside [{low:g}, {high:g}]")
    low, high = population.declared_range.relative_thickness
    if not low <= context.relative_thickness <= high:
        problems.append(f"{wall_in_words(context)}, outside [{low:g}, {high:g}]")
    return tuple(problems)
