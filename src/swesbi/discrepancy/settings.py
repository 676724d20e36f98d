"""Settings of the choice of the discrepancy."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from swesbi.settings import Settings
from swesbi.speed_model.settings import DiscrepancySettings

Fraction = Annotated[float, Field(ge=0, le=0.5)]
Cycle = Annotated[float, Field(ge=0, le=0.1)]


class DiscrepancyStudySettings(Settings):
    """The generated cohort, the grid of (delta, tau) and the effort put into each evidence."""

    subjects: int = Field(ge=1, description="generated subjects")
    speed_fractions: tuple[Fraction, ...] = Field(min_length=1, description="grid of delta")
    timing_cycles: tuple[Cycle, ...] = Field(min_length=1, description="grid of tau")
    simulations_per_round: int = Field(ge=100, description="simulations that each proposal adds")
    max_rounds: int = Field(ge=1, description="proposals at most, the prior among them")
    min_effective_draws: int = Field(ge=10, description="effective sample size at which a pair is done")
    interval: float = Field(gt=0, lt=1, description="mass of the intervals whose coverage is counted")

    @property
    def pairs(self) -> tuple[DiscrepancySettings, ...]:
        """Every pair of the grid, tau running fastest."""
        return tuple(
            DiscrepancySettings(speed_fraction=delta, timing_cycle=tau)
            for delta in self.speed_fractions
            for tau in self.timing_cycles
        )
