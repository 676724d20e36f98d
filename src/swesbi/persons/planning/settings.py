"""Settings of planned studies: whose hearts, how they differ and respond, how many studies are simulated."""

from __future__ import annotations

from typing import Annotated, Final, Literal, Self

from pydantic import Field, model_validator

from swesbi.base.settings import Level, Settings

Spread = Annotated[float, Field(ge=0.0, lt=0.5)]
Design = Literal["paired", "groups"]
PAIRED: Final = "paired"
GROUPS: Final = "groups"
DESIGNS: Final = (PAIRED, GROUPS)
"""Two visits of each person; one visit of each person of two groups."""


class PlannedPersonsSettings(Settings):
    """The persons of a bank; spreads are standard deviations of logarithms."""

    number: int = Field(ge=4, description="persons of a bank, from which studies are drawn")
    group: str = Field(description="group of the population whose contexts they have")
    prior_share: float = Field(
        gt=0.0, le=1.0, description="spread of theta and passive scale between persons, over the prior's"
    )
    visit_spread: Spread = Field(description="of each of theta from visit to visit of a person")
    response_spread: Spread = Field(description="of the effect between persons")
    passive_scale_spread: Spread = Field(description="of the passive scale from visit to visit")
    loading_spread: Spread = Field(description="of R_d, and of the time constant, from visit to visit")
    heart_rate_spread: Spread = Field(description="of the heart rate from visit to visit")
    kept_scale_share: float = Field(
        ge=0.0, le=1.0, description="share of the variance of the log scale of speeds that a person keeps"
    )
    weeks_between: float = Field(gt=0.0, description="between the visits")
    ejection_fraction: tuple[float, float] = Field(description="at the first visit, of who takes part")


class PlannedStudiesSettings(Settings):
    """The simulated studies of a bank."""

    sizes: tuple[Annotated[int, Field(ge=2)], ...] = Field(
        min_length=3, description="numbers of persons that are tried, of each group where there are two"
    )
    proposal_sizes: tuple[Annotated[int, Field(ge=2)], ...] = Field(
        min_length=1, description="numbers of persons about whose posteriors hyperparameters are drawn"
    )
    hyperdraws: int = Field(ge=200, description="of each of these, with the effect and without")
    recycled_draws: int = Field(ge=50, description="of each person's posterior")
    studies: int = Field(ge=20, description="of each number of persons, with the effect and without")
    resamples: int = Field(ge=4, description="of the bank, for the Monte Carlo error of a bank of its size")
    least_effective: float = Field(gt=1.0, description="effective hyperdraws below which a study is rough")

    @model_validator(mode="after")
    def _check_sizes(self) -> Self:
        if list(self.sizes) != sorted(set(self.sizes)):
            raise ValueError(f"sizes = {list(self.sizes)}: list them in ascending order, each once")
        return self


class PlanSettings(Settings):
    """Planned studies: persons, studies, and when an effect counts as found."""

    persons: PlannedPersonsSettings
    studies: PlannedStudiesSettings
    probability: Level = Field(description="of an effect in its direction, above which a study finds it")
    power: Level = Field(description="share of studies that are to find it, unless another is asked for")
