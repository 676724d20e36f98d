"""Settings of the exam: who sits it, and when a share says something."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import Field

from swesbi.base import Settings

EXAM: Final = "exam"
"""Name of the exam's streams; every other name gives hearts of development."""
Letter = Literal["a", "b", "c", "d", "e", "f", "g", "h"]
NoiseLevel = Literal["cohort", "former"]
"""How noisy the recordings are: as the study's cohort, or as it was before it was recorded anew."""
COHORT_NOISE: Final[NoiseLevel] = "cohort"
FORMER_NOISE: Final[NoiseLevel] = "former"
NOISE_LEVELS: Final = (COHORT_NOISE, FORMER_NOISE)
WITH_PRESSURES: Final = "with"
"""What says of a table of the exam that its answers are those with cuff pressures."""
Hearts = Annotated[int, Field(ge=1)]


class ScoreSettings(Settings):
    """When an interval is asked, and how certain a share is."""

    least_supported: int = Field(ge=1, description="a generator with fewer supported hearts is not tested")
    confidence: float = Field(gt=0, lt=1, description="of the Clopper-Pearson interval on a coverage")


class MadeSettings(Settings):
    """What hearts depend on beside the population, the prior and the acquisition."""

    loud_factor: float = Field(gt=1, description="of generator g: its errors over those that are assumed")


class ExamSettings(Settings):
    """Who sits the exam, and how it is counted."""

    hearts: dict[Letter, Hearts] = Field(min_length=1, description="number of hearts by generator")
    small_hearts: dict[Letter, Hearts] = Field(min_length=1, description="of the small exam of development")
    former_noise_factor: float = Field(
        gt=1, le=4, description="errors of samples, repeats and sweeps at the former noise, over acquisition"
    )
    made: MadeSettings
    score: ScoreSettings

    def noise_factor(self, level: NoiseLevel) -> float:
        """Return the errors of samples, repeats and sweeps at a level of noise, over those of acquisition."""
        return self.former_noise_factor if level == FORMER_NOISE else 1.0

    def hearts_of(self, stream: str) -> dict[Letter, Hearts]:
        """Return how many hearts of each generator are asked for: of the exam, or of a small one."""
        return self.hearts if stream == EXAM else self.small_hearts
