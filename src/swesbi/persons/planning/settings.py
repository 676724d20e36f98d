"""Settings of planned studies: whose hearts, how they differ and respond, how many studies are simulated."""

from __future__ import annotations

from typing import Annotated, Final, Literal, Self

from pydantic import Field, model_validator

from swesbi.base.settings import Level, Settings

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
