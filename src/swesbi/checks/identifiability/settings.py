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

    confidence_levels: tuple[Level, ...] = Field(
        min_length=1, description="Levels of likelihood-ratio regions. Chosen."
    )
    coarse_points: int = Field(
        ge=5,
        le=101,
        description="Points a parameter over the whole prior box, before closing in. Chosen: with 11 a "
        "second mode of G was lost.",
    )
    points: int = Field(
        ge=5,
        le=201,
        description="Points a parameter over the region that matters. Chosen: intervals to 3 % of their "
        "width; with 15 that of C came out smaller.",
    )
    pair_points: int = Field(
        ge=5,
        le=201,
        description="Points along each parameter of the pair k_0, k_ATP. Chosen: contours as with 21, for "
        "half the time.",
    )
    prior_starts: int = Field(
        ge=10, le=100_000, description="Prior draws among which the search starts. Chosen."
    )
    searches: int = Field(
        ge=1,
        le=100,
        description="Starts of the search for the maximum, the likeliest draws from the prior. Chosen.",
    )


class DesignSettings(Settings):
    """Recordings that a lab could make instead."""

    draws: int = Field(
        ge=1,
        le=10_000,
        description="Posterior draws that designs are averaged over. Chosen: expected sd to 3 %.",
    )
    repeats: Steps = Field(description="Repeats at every phase. Chosen.")
    phases: Steps = Field(description="Numbers of phases, evenly over the cycle. Chosen.")
    offsets: int = Field(
        ge=1,
        le=20,
        description="Positions of the first phase that a design is averaged over. Chosen: where the first "
        "phase falls is chance.",
    )
    discrepancy_range_cycle: float = Field(
        gt=0.0,
        le=0.5,
        description="Model errors at phases closer than this are correlated. Chosen: the distance of 20 "
        "phases, whose model errors the likelihood takes as independent.",
    )
    placement_candidates: int = Field(ge=10, le=1000, description="Phases among which to choose. Chosen.")
    placement_phases: int = Field(ge=1, le=100, description="Phases chosen, one after the other. Chosen.")
    placement_draws: int = Field(
        ge=1, le=1000, description="Posterior draws a subject in the choice. Chosen."
    )

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

    interval: Level = Field(
        description="Mass of the credible intervals whose width is reported, level of the "
        "likelihood-ratio intervals."
    )
    difference_step: float = Field(
        gt=0.0,
        le=0.2,
        description="Step of the differences in log phi or logit. Chosen: information is the same to 1 % "
        "from 0.005 to 0.04.",
    )
    information_draws: int = Field(
        ge=1,
        le=10_000,
        description="Posterior draws that information is averaged over. Chosen: expected sd to 1 %.",
    )
    shown_draws: int = Field(ge=1, le=10_000, description="Posterior draws kept for the figure. Chosen.")
    profile: ProfileSettings = Field(description="Profiles of the likelihood.")
    design: DesignSettings = Field(description="Other designs of a recording.")
