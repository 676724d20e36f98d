"""Settings of the study of identifiability."""

from __future__ import annotations

from pydantic import Field

from swesbi.base.settings import Settings


class IdentifiabilitySettings(Settings):
    """Information of the phases, and what more repeats buy."""

    difference_step: float = Field(
        gt=0.0,
        le=0.2,
        description="Step of the differences in log phi. Chosen: information is the same to 1 % from 0.005 "
        "to 0.04.",
    )
    information_draws: int = Field(
        ge=1,
        le=10_000,
        description="Posterior draws that information is averaged over. Chosen: expected sd to 1 %.",
    )
    repeats_draws: int = Field(
        ge=1,
        le=10_000,
        description="Posterior draws that the page of an answer averages more repeats over. Chosen: "
        "expected sd to 3 %.",
    )
