"""Settings of the observation model, the estimator, the support criteria and the posterior."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from swesbi.settings import Settings

Level = Annotated[float, Field(gt=0.0, lt=1.0)]
Epoch = Annotated[int, Field(ge=1)]
CheckpointEpochs = Annotated[
    tuple[Epoch, ...], Field(description="epochs whose weights are kept; the best and the last always are")
]
Seeds = Annotated[
    tuple[Annotated[int, Field(ge=0)], ...],
    Field(min_length=1, description="seeds of the acquisition noise; each volunteer is recorded under each"),
]
Deviation = Annotated[float, Field(ge=0.0)]


class ObservationModelSettings(Settings):
    """Additive Gaussian noise on the features (paper, Eq. 5): diagonal, zero for every feature not named."""

    feature_noise_sd: dict[str, Deviation] = Field(
        description="standard deviation by feature, in the unit that ends the feature's name"
    )
    augmentations: int = Field(ge=1, description="noisy copies of each simulated feature vector, N_aug")


class EstimatorSettings(Settings):
    """Architecture and training of the conditional density estimator, in the terms of sbi.

    ``max_num_epochs`` is handed to sbi as it is; sbi stops after one epoch more.
    """

    model: Literal["maf"] = Field(description="masked autoregressive flow")
    procedure: Literal["sbi", "fast"] = Field(
        description="sbi's own passes over the rows, or the same passes by a lean flow"
    )
    transforms: int = Field(ge=1, description="autoregressive transforms")
    hidden_features: int = Field(ge=1, description="hidden units a layer")
    blocks: int = Field(ge=1, description="autoregressive blocks a transform")
    z_score_theta: Literal["independent", "none"] = Field(description="sbi's standardisation of theta")
    z_score_x: Literal["independent", "none"] = Field(description="sbi's standardisation of its input")
    batch_size: int = Field(ge=2)
    learning_rate: float = Field(gt=0.0, description="of Adam")
    max_num_epochs: int = Field(ge=1)
    stop_after_epochs: int = Field(ge=1, description="epochs without improvement before training stops")
    validation_fraction: Level = Field(description="share of the pool's rows held out")
    clip_max_norm: float = Field(gt=0.0, description="gradients are clipped to this norm")


class SupportSettings(Settings):
    """The two criteria of prior support (paper, Sec. 2.5)."""

    max_abs_z: float = Field(gt=0.0, description="largest admitted |z_obs,j| of the conditioning vector")
    min_in_prior_draws: int = Field(ge=1, description="least number of candidates within the prior's bounds")
    candidate_draws: int = Field(ge=1, description="draws from the estimator, not filtered")

    @model_validator(mode="after")
    def _check_attainable(self) -> Self:
        if self.min_in_prior_draws > self.candidate_draws:
            raise ValueError(
                f"min_in_prior_draws = {self.min_in_prior_draws} cannot be met by "
                f"candidate_draws = {self.candidate_draws}; lower the first or raise the second"
            )
        return self


class PosteriorSettings(Settings):
    """What is kept of the candidates, and the credible interval."""

    draws: int = Field(ge=1, description="in-prior draws kept, at most")
    unfiltered_draws: int = Field(ge=1, description="first candidates kept as they came")
    interval: Level = Field(description="mass of the equal-tailed credible interval")


class RecoverySettings(Settings):
    """Recovery of known parameters from synthetic observations."""

    recordings: int = Field(ge=1, description="synthetic observations N, shared out over the subjects")
    candidate_draws: int = Field(ge=1, description="draws from the estimator for each of them")
    min_in_prior_draws: int = Field(ge=2, description="fewer in-prior draws: counted apart, not scored")
    nominal_levels: tuple[Level, ...] = Field(min_length=1, description="masses of the credible intervals")
    confidence: Level = Field(description="of the binomial (Clopper-Pearson) interval on the coverage")

    @model_validator(mode="after")
    def _check_attainable(self) -> Self:
        if self.min_in_prior_draws > self.candidate_draws:
            raise ValueError(
                f"min_in_prior_draws = {self.min_in_prior_draws} cannot be met by "
                f"candidate_draws = {self.candidate_draws}; lower the first or raise the second"
            )
        return self


class AcquisitionSeedsSettings(Settings):
    """The virtual volunteers recorded anew, with other noise."""

    seeds: Seeds


class EpochStudySettings(Settings):
    """How inference changes while the network is trained: recovery and posteriors at checkpoints.

    Recovery follows the settings of the experiment's recovery, predictions those of its predictive checks.
    """

    checkpoint_epochs: CheckpointEpochs
    candidate_draws: int = Field(ge=1, description="draws from each checkpoint for a subject, at most")
