"""Settings of recovery, predictive checks, CMA-ES, the study over epochs and variants of an experiment."""

from __future__ import annotations

from typing import Annotated, Final, Self

from pydantic import Field, model_validator

from swesbi.base.settings import Level, Settings

Fraction = Annotated[float, Field(ge=0, le=0.5)]
Cycle = Annotated[float, Field(ge=0, le=0.1)]
Weight = Annotated[float, Field(ge=0.0)]
Epoch = Annotated[int, Field(ge=1)]
CheckpointEpochs = Annotated[
    tuple[Epoch, ...], Field(description="Epochs whose weights are kept; the best and the last always are.")
]
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

    checkpoint_epochs: CheckpointEpochs = Field(
        description="Epochs whose weights are kept; the best and the last always are. Chosen: even in the "
        "logarithm."
    )
    candidate_draws: int = Field(
        ge=1,
        description="Draws from each checkpoint for a subject, at most. Chosen: a subject with fewer "
        "in-prior draws than support needs has no numbers.",
    )
