"""Sections of the configuration beside the experiments: studies of them, subjects outside them, resources."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from swesbi.base.settings import Settings
from swesbi.checks.settings import CmaesSettings
from swesbi.config.experiments import Name
from swesbi.persons.planning.settings import PlanSettings
from swesbi.verdict.settings import UninformativeSettings


class CmaesStudySettings(Settings):
    """The optimisation-based reference: within the bounds of one of the priors."""

    prior: Name = Field(description="name of the prior whose bounds limit the search")
    search: CmaesSettings


class PlanChoiceSettings(PlanSettings):
    """Planned studies, answered by the network of one experiment."""

    experiment: Name = Field(description="an experiment over a population")


class NewSubjectsSettings(Settings):
    """Recordings that the trained network answers without being trained on them."""

    phases: int | None = Field(
        ge=8, le=60, description="gated phases of their recordings; null: as configured"
    )
    cohort_title: str = Field(min_length=1, description="what their figures call them")
    reference_fit: bool = Field(description="whether an answer waits for a CMA-ES fit, drawn beside it")
    margin_fraction: float = Field(
        ge=0.0, lt=1.0, description="how far beyond the contexts trained on, as a fraction of their limits"
    )
    noise_level: float = Field(
        gt=0.0, lt=0.5, description="of the test that a recording has the pool's noise"
    )
    uninformative: UninformativeSettings = Field(description="when a recording has told nothing")


class ResourceSettings(Settings):
    """How the work is split and where it runs; nothing here may change a result."""

    shards_per_subject: int = Field(ge=1, le=1000, description="simulation jobs a subject and prior")
    population_parts: int = Field(
        ge=1, le=1000, description="jobs of the simulations, and of the calibration, over a population"
    )
    subjects_per_job: int | None = Field(
        ge=1, description="subjects of a job of a light stage; null: four, more of a large cohort"
    )
    device: Literal["auto", "cpu", "cuda"] = Field(description="where the network is trained")
