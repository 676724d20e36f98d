"""Settings of the study of identifiability."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from swesbi.base.settings import Settings

Level = Annotated[float, Field(gt=0.0, lt=1.0)]
Count = Annotated[int, Field(ge=1, le=1000)]
Steps = Annotated[tuple[Count, ...], Field(min_length=1)]


class ProfileSettings(Settings):
    """Profiles of the likelihood: grids, and the search over the parameters that are not held."""

    confidence_levels: tuple[Level, ...] = Field(min_length=1, description="of likelihood-ratio regions")
    coarse_points: int = Field(ge=5, le=101, description="points a parameter over the whole prior box")
    points: int = Field(ge=5, le=201, description="points a parameter over the region that matters")
    pair_points: int = Field(ge=5, le=201, description="points along each parameter of the pair k_0, k_ATP")
    prior_starts: int = Field(ge=10, le=100_000, description="prior draws among which the search starts")
    searches: int = Field(ge=1, le=100, description="starts of the search for the maximum")


class DesignSettings(Settings):
    """Recordings that a lab could make instead."""

    draws: int = Field(ge=1, le=10_000, description="posterior draws that designs are averaged over")
    repeats: Steps = Field(description="repeats at every phase")
    phases: Steps = Field(description="numbers of phases, evenly over the cycle")
    offsets: int = Field(
        ge=1, le=20, description="positions of the first phase that a design is averaged over"
    )
    discrepancy_range_cycle: float = Field(
        gt=0.0, le=0.5, description="model errors at phases closer than this are correlated"
    )
    placement_candidates: int = Field(ge=10, le=1000, description="phases among which to choose")
    placement_phases: int = Field(ge=1, le=100, description="phases chosen, one after the other")
    placement_draws: int = Field(ge=1, le=1000, description="posterior draws a subject in the choice")

    @model_validator(mode="after")
    def _check_candidates(self) -> Self:
        if self.placement_phases > self.placement_candidates:
            raise ValueError(
                f"placement_phases = {self.placement_phases} of placement_candidates = "
                f"{self.placement_candidates}: choose no more phases than there are candidates"
            )
        for name, values in (("repeats", self.repeats), ("phases", self.phases)):
            if list(values) != sorted(set(values)):
                raise ValueError(f"{name} = {list(values)}: need ascending numbers, each once")
        if self.placement_phases < self.phases[0]:
            raise ValueError(
                f"placement_phases = {self.placement_phases} is less than the least of phases = "
                f"{list(self.phases)}: chosen phases are compared with as many even ones"
            )
        return self


class IdentifiabilitySettings(Settings):
    """Contraction, profiles, information of the phases, and designs."""

    interval: Level = Field(description="mass of the credible intervals whose width is reported")
    difference_step: float = Field(gt=0.0, le=0.2, description="step of the differences in log phi or logit")
    information_draws: int = Field(
        ge=1, le=10_000, description="posterior draws that information is averaged over"
    )
    shown_draws: int = Field(ge=1, le=10_000, description="posterior draws kept for the figure")
    profile: ProfileSettings
    design: DesignSettings
