"""Settings of the exam: who sits it, and when a share says something."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from swesbi.base import Settings

Letter = Literal["a", "b", "c", "d", "e", "f", "g", "h"]
Hearts = Annotated[int, Field(ge=1)]


class ScoreSettings(Settings):
    """When an interval is asked, and how certain a share is."""

    least_supported: int = Field(ge=1, description="a generator with fewer supported hearts is not tested")
    confidence: float = Field(gt=0, lt=1, description="of the Clopper-Pearson interval on a coverage")


class ExamSettings(Settings):
    """How the hearts are made and counted."""

    hearts: dict[Letter, Hearts] = Field(min_length=1, description="number of hearts by generator")
    small_hearts: dict[Letter, Hearts] = Field(min_length=1, description="of the small exam of development")
    assumed_scale_fraction: float = Field(
        gt=0, lt=1, description="sd of the log of the common scale of the speeds that inference assumes"
    )
    loud_factor: float = Field(
        gt=1, description="of generator g: its errors over those that inference assumes"
    )
    score: ScoreSettings
