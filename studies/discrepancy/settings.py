"""Settings of the choice of the discrepancy: the generated cohort, the grid, the effort."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from studies.section import check_experiment
from swesbi.base.settings import Settings
from swesbi.checks.settings import Cycle, Fraction
from swesbi.config.study import Study
from swesbi.config.view import View
from swesbi.measurement.settings import DiscrepancySettings


class DiscrepancyStudySettings(Settings):
    """The generated cohort, the grid of (delta, tau) and the effort put into each evidence."""

    subjects: int = Field(
        ge=1,
        description="Generated subjects. Chosen: tells both to about one step of the grid (standard "
        "errors in the table).",
    )
    speed_fractions: tuple[Fraction, ...] = Field(
        min_length=1, description="Grid of delta. Chosen: up to more than the best by far."
    )
    timing_cycles: tuple[Cycle, ...] = Field(min_length=1, description="Grid of tau. Chosen likewise.")
    simulations_per_round: int = Field(ge=100, description="Simulations that each proposal adds. Chosen.")
    max_rounds: int = Field(
        ge=1, description="Proposals at most, the prior among them. Chosen: rarely reached."
    )
    min_effective_draws: int = Field(
        ge=10,
        description="Effective sample size at which a pair is done. Chosen: log evidence of one subject "
        "to about 0.04.",
    )
    interval: float = Field(
        gt=0, lt=1, description="Mass of the intervals whose coverage is counted. As everywhere."
    )

    @property
    def pairs(self) -> tuple[DiscrepancySettings, ...]:
        """Every pair of the grid, tau running fastest."""
        return tuple(
            DiscrepancySettings(speed_fraction=delta, timing_cycle=tau)
            for delta in self.speed_fractions
            for tau in self.timing_cycles
        )


class ChoiceSettings(DiscrepancyStudySettings):
    """The choice of the discrepancy for one experiment: the section ``discrepancy`` of config.yaml."""

    experiment: str = Field(min_length=1, description="An experiment of kind speeds.")


def choice_settings(study: Study, choice: ChoiceSettings) -> dict[str, Any]:
    """Return what the choice depends on; the discrepancy that the experiment has already is not among it."""
    check_experiment("discrepancy", choice.experiment, study.config.speed_experiments, "of kind speeds")
    section = choice.to_plain()
    none = {"speed_fraction": 0.0, "timing_cycle": 0.0}  # what is chosen already must not matter
    settings = View(study, {"experiment": section.pop("experiment")}).together(
        "model", "acquisition", "recording"
    )
    settings["model"]["discrepancy"] = none
    return settings | {"study": section}
