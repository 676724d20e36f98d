"""Sections of the configuration beside the experiments: studies of them, subjects outside them, resources."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from swesbi.base.settings import Settings
from swesbi.checks.settings import CmaesSettings
from swesbi.config.experiments import Name
from swesbi.persons.planning.settings import PlanSettings
from swesbi.recording.settings import NoisePriorSettings
from swesbi.verdict.settings import UninformativeSettings


class CmaesStudySettings(Settings):
    """The optimisation-based reference: within the bounds of one of the priors."""

    prior: Name = Field(description="Name of the prior whose bounds limit the search. Paper, Sec. 2.5.")
    search: CmaesSettings = Field(description="The searches.")


class PlanChoiceSettings(PlanSettings):
    """Planned studies, answered by the network of one experiment."""

    experiment: Name = Field(
        description="An experiment over a population, whose network answers the simulated persons. They "
        "have hearts that no cohort has."
    )


class NewSubjectsSettings(Settings):
    """Recordings outside the study, and how they are answered."""

    phases: int | None = Field(
        ge=8, le=60, description="Gated phases of their recordings; null: as many as recording.phases."
    )
    cohort_title: str = Field(min_length=1, description="What their figures call them.")
    margin_fraction: float = Field(
        ge=0.0,
        lt=1.0,
        description="How far heart rate, LVEDV and IVSd may lie beyond those trained on, as a fraction of "
        "these limits. Chosen: a tenth.",
    )
    noise_level: float = Field(
        gt=0.0,
        lt=0.5,
        description="False-alarm rate of the test that a recording has the noise of its folder, for many "
        "repeats. Chosen: of three sweeps it is two to three times as high.",
    )
    noise_prior: NoisePriorSettings = Field(
        description="What is expected of the noise of their folder, before its repeats are seen."
    )
    uninformative: UninformativeSettings = Field(description="When a recording counts as uninformative.")


class ResourceSettings(Settings):
    """How the work is split and where it runs; nothing here may change a result."""

    shards_per_subject: int = Field(
        ge=1,
        le=1000,
        description="Simulation jobs a subject and prior. One takes a second, most of it start-up.",
    )
    population_parts: int = Field(
        ge=1,
        le=1000,
        description="Jobs of the simulations, and of the calibration, of an experiment over a population.",
    )
    device: Literal["auto", "cpu", "cuda"] = Field(
        description="Where the network is trained. auto takes a GPU where there is one, but not for "
        "procedure fast."
    )
