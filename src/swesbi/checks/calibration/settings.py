"""Settings of the calibration runs."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from swesbi.base.settings import Level, Settings
from swesbi.posterior.settings import McmcSettings


class RecordingsSettings(Settings):
    """Synthetic recordings of known parameters, and how each is inferred."""

    model_noise: int = Field(
        ge=1,
        description="Recordings a subject under the model's own noise. Chosen: coverage of 90 % to 3.4 "
        "points (two standard errors) over the cohort. `make full` has 250.",
    )
    sample_by_sample: int = Field(
        ge=1,
        description="Recordings a subject, acquired sample by sample and ingested. Chosen: coverage of 90 "
        "% to 4.7 points over the cohort. `make full` has 40.",
    )
    network_draws: int = Field(
        ge=9,
        description="Draws of the network. One less than a multiple of 100, the points of the "
        "distribution functions.",
    )
    effective_draws: int = Field(
        ge=10,
        description="Effective draws of each posterior, at least. Chosen: as many as ranks of "
        "simulation-based calibration have; 0.2 s a recording.",
    )
    misfit_draws: int = Field(ge=10, description="Posterior draws whose chi-square is taken. Chosen.")


class PushesSettings(Settings):
    """Free-running recordings of known parameters."""

    recordings: int = Field(
        ge=1,
        description="Recordings of each number of pushes, every one of a context of its own. Chosen: "
        "coverage of 90 % to 3.0 points each, 1.3 in all.",
    )
    pushes: tuple[Annotated[int, Field(ge=2, le=400)], ...] = Field(
        min_length=1, description="Numbers of accepted pushes. Chosen."
    )


class LocalSettings(Settings):
    """Calibration at the subjects' own data, and the comparison of samplers there."""

    replicates: int = Field(
        ge=1,
        description="Second recordings a subject and sampler, of phi drawn from the subject's posterior. "
        "Chosen: 80 over the cohort. `make full` has 20 a subject.",
    )
    effective_draws: int = Field(
        ge=10, description="Effective draws given both recordings, at least. Chosen as of other recordings."
    )
    two_sample_draws: int = Field(
        ge=50,
        description="Draws of each sampler that a classifier sees. Chosen: accuracies to 1.1 points (one "
        "standard error).",
    )
    mcmc: McmcSettings = Field(
        description="The long chains that both are compared with, of the same sampler as in the exact "
        "posterior."
    )
    chains: int | None = Field(
        ge=0,
        description="Subjects with long chains, the first ones of the cohort; null: all. Chosen; `make "
        "full` has all.",
    )

    @model_validator(mode="after")
    def _check_chains(self) -> Self:
        if self.mcmc.min_effective_draws < self.two_sample_draws:
            raise ValueError(
                f"mcmc.min_effective_draws = {self.mcmc.min_effective_draws} is less than two_sample_draws = "
                f"{self.two_sample_draws}: a classifier would learn draws that repeat each other"
            )
        return self


class JudgementSettings(Settings):
    """What is required of the posteriors."""

    alpha: Level = Field(
        description="Probability that a set of bands is left by chance: simultaneous 95 % bands, "
        "Bonferroni over the quantities."
    )
    least_contraction: float = Field(
        ge=0, lt=1, description="Less than this: the data were hardly used. Chosen: the prior itself has 0."
    )
    max_c2st: float = Field(
        gt=0.5,
        lt=1,
        description="Accuracy of a classifier that still finds no difference. Chosen: 0.5 is no difference.",
    )
    nominal_levels: tuple[Level, ...] = Field(
        min_length=1, description="Masses of the credible intervals. As in the other experiments."
    )
    confidence: Level = Field(
        description="Level of the binomial (Clopper-Pearson) interval on each coverage."
    )


class CalibrationSettings(Settings):
    """Everything about calibration: recordings, subjects, and what is asked."""

    recordings: RecordingsSettings = Field(
        description="Recordings a subject; eight subjects make eight times as many."
    )
    local: LocalSettings = Field(description="Calibration at each subject's own data.")
    judgement: JudgementSettings = Field(description="What is required of the posteriors.")
