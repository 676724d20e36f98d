"""Settings of the checks: predictive, CMA-ES, recovery, epochs, calibration, identifiability."""

from __future__ import annotations

from typing import Annotated, Final, Self

from pydantic import Field, model_validator

from swesbi.base.settings import Level, Settings
from swesbi.posterior.settings import McmcSettings

Fraction = Annotated[float, Field(ge=0, le=0.5)]
Cycle = Annotated[float, Field(ge=0, le=0.1)]
Weight = Annotated[float, Field(ge=0.0)]
Epoch = Annotated[int, Field(ge=1)]
BASE: Final = "base"
"""Name of the variant that changes nothing."""


class PredictiveSettings(Settings):
    """The prior and posterior predictive checks."""

    draws: int = Field(
        ge=20,
        description="Posterior draws propagated through the model, and prior simulations beside them. "
        "Chosen.",
    )
    interval: float = Field(
        gt=0.0, lt=1.0, description="Probability mass of both predictive intervals (paper, Sec. 2.5)."
    )
    features: tuple[str, ...] = Field(
        description="Features checked against their predictive intervals, observation noise included. "
        "They are the five noise-modelled features (paper, Sec. 3)."
    )


class CurveLossSettings(Settings):
    """Weights of the three terms of the curve loss; all dimensionless.

    The paper (Sec. 2.5) names the three terms; equal weights are chosen.
    """

    mae_weight: Weight = Field(description="Of the mean absolute error over the observed range.")
    correlation_weight: Weight = Field(description="Of one minus the Pearson correlation.")
    peak_weight: Weight = Field(description="Of the relative mismatch of the peak.")

    @model_validator(mode="after")
    def _check_some_weight(self) -> Self:
        if self.mae_weight + self.correlation_weight + self.peak_weight == 0.0:
            raise ValueError("all weights of the curve loss are 0: every curve would fit equally well")
        return self


class CmaesSettings(Settings):
    """The CMA-ES searches: one run per seed, the best of all taken.

    The search variable is u in [0, 1]^3, u = log(theta / low) / log(high / low) with the prior's hard
    bounds, so ``sigma0`` is the initial step as a fraction of the logarithmic width of the box,
    the same for the three parameters.
    """

    seeds: tuple[int, ...] = Field(
        min_length=1, description="One independent run for each (paper, Sec. 2.5)."
    )
    population_size: int = Field(ge=4, description="Simulations per generation (paper, Sec. 2.5).")
    generations: int = Field(ge=1, description="At most; a converged run stops earlier (paper, Sec. 2.5).")
    sigma0: float = Field(
        gt=0.0, le=1.0, description="Initial step, fraction of the log-width of the bounds. Chosen."
    )
    loss: CurveLossSettings = Field(description="Weights of the loss.")

    @model_validator(mode="after")
    def _check_distinct(self) -> Self:
        if len(set(self.seeds)) < len(self.seeds):
            raise ValueError(f"seeds are not distinct: {list(self.seeds)}")
        if min(self.seeds) < 0:
            raise ValueError(f"seeds must be 0 or more, found {min(self.seeds)}")
        return self


class RecoverySettings(Settings):
    """Recovery of known parameters from synthetic observations."""

    recordings: int = Field(
        ge=1, description="Synthetic observations N, shared out over the subjects (paper, Sec. 3)."
    )
    candidate_draws: int = Field(
        ge=1,
        description="Draws from the estimator for each of them. Chosen: interval limits of one recording "
        "to about 5 % of the posterior sd.",
    )
    min_in_prior_draws: int = Field(
        ge=2,
        description="Recordings with fewer in-prior draws are counted apart and not scored. Chosen: fewer "
        "give no usable 95 % interval.",
    )
    nominal_levels: tuple[Level, ...] = Field(
        min_length=1,
        description="Masses of the credible intervals. 0.9 as in the paper; the others show the shape of "
        "the miscalibration.",
    )
    confidence: Level = Field(description="Level of the binomial (Clopper-Pearson) interval on the coverage.")

    @model_validator(mode="after")
    def _check_attainable(self) -> Self:
        if self.min_in_prior_draws > self.candidate_draws:
            raise ValueError(
                f"min_in_prior_draws = {self.min_in_prior_draws} cannot be met by "
                f"candidate_draws = {self.candidate_draws}; lower the first or raise the second"
            )
        return self


class EpochStudySettings(Settings):
    """How inference changes while the network is trained: recovery and posteriors at checkpoints.

    Recovery follows the settings of the experiment's recovery, predictions those of its predictive checks.
    """

    checkpoint_epochs: tuple[Epoch, ...] = Field(
        description="Epochs whose weights are kept; the best and the last always are. Chosen: even in the "
        "logarithm."
    )
    candidate_draws: int = Field(
        ge=1,
        description="Draws from each checkpoint for a subject, at most. Chosen: a subject with fewer "
        "in-prior draws than support needs has no numbers.",
    )


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
        description="Draws of the network, of those in the first round of each posterior. One less than a "
        "multiple of 100, the points of the distribution functions.",
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
