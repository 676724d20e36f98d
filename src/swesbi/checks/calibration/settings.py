"""Settings of the calibration runs."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from swesbi.base.settings import Level, Settings
from swesbi.posterior.settings import McmcSettings


class RecordingsSettings(Settings):
    """Synthetic recordings of known parameters, and how each is inferred."""

    own: int = Field(ge=1, description="recordings a subject under the model's own noise")
    acquired: int = Field(ge=1, description="recordings a subject, acquired sample by sample and ingested")
    network_draws: int = Field(ge=9, description="draws of the network; best one less than a multiple of 100")
    effective_draws: int = Field(ge=10, description="effective draws of each posterior, at least")
    misfit_draws: int = Field(ge=10, description="posterior draws whose chi-square is taken")
    strip_fraction: float = Field(gt=0, lt=0.5, description="width of the strip at a bound, over the box's")


class PushesSettings(Settings):
    """Free-running recordings of known parameters."""

    recordings: int = Field(ge=1, description="of each number of pushes, every one of a context of its own")
    pushes: tuple[Annotated[int, Field(ge=2, le=400)], ...] = Field(
        min_length=1, description="numbers of accepted pushes"
    )


class LocalSettings(Settings):
    """Calibration at the subjects' own data, and the comparison of samplers there."""

    replicates: int = Field(ge=1, description="phi drawn from each subject's posterior, for each sampler")
    effective_draws: int = Field(ge=10, description="effective draws given both recordings, at least")
    two_sample_draws: int = Field(ge=50, description="draws of each sampler that a classifier sees")
    mcmc: McmcSettings = Field(description="the long chains that both are compared with")
    chains: int | None = Field(ge=0, description="subjects with long chains, the first ones; null: all")

    @model_validator(mode="after")
    def _check_chains(self) -> Self:
        if self.mcmc.min_effective_draws < self.two_sample_draws:
            raise ValueError(
                f"mcmc.min_effective_draws = {self.mcmc.min_effective_draws} is less than two_sample_draws = "
                f"{self.two_sample_draws}: a classifier would learn draws that repeat each other"
            )
        return self


class JudgementSettings(Settings):
    """What is asked of the posteriors."""

    alpha: Level = Field(description="probability that a set of bands is left by chance")
    least_contraction: float = Field(ge=0, lt=1, description="less than this: the data were hardly used")
    max_c2st: float = Field(
        gt=0.5, lt=1, description="accuracy of a classifier that still finds no difference"
    )
    nominal_levels: tuple[Level, ...] = Field(min_length=1, description="masses of the credible intervals")
    confidence: Level = Field(description="of the binomial (Clopper-Pearson) interval on each coverage")


class CalibrationSettings(Settings):
    """Everything about calibration: recordings, subjects, and what is asked."""

    recordings: RecordingsSettings
    local: LocalSettings
    judgement: JudgementSettings
