"""Settings of the exam: who sits it, and when a share says something."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import Field

from swesbi.base import Settings

EXAM: Final = "exam"
"""Name of the exam's streams; every other name gives hearts of development."""
Letter = Literal["a", "b", "c", "d", "e", "f", "g", "h"]
Hearts = Annotated[int, Field(ge=1)]


class ScoreSettings(Settings):
    """When an interval is asked, and how certain a share is."""

    least_supported: int = Field(ge=1, description="a generator with fewer supported hearts is not tested")
    confidence: float = Field(gt=0, lt=1, description="of the Clopper-Pearson interval on a coverage")


class MadeSettings(Settings):
    """What hearts depend on beside the population, the prior and the acquisition."""

    assumed_scale_fraction: float = Field(
        gt=0, lt=1, description="sd of the log of the common scale of the speeds that inference assumes"
    )
    loud_factor: float = Field(gt=1, description="of generator g: its errors over those that are assumed")


class ExamSettings(Settings):
    """Who sits the exam, and how it is counted."""

    hearts: dict[Letter, Hearts] = Field(min_length=1, description="number of hearts by generator")
    small_hearts: dict[Letter, Hearts] = Field(min_length=1, description="of the small exam of development")
    made: MadeSettings
    score: ScoreSettings

    def hearts_of(self, stream: str) -> dict[Letter, Hearts]:
        """Return how many hearts of each generator are asked for: of the exam, or of a small one."""
        return self.hearts if stream == EXAM else self.small_hearts
