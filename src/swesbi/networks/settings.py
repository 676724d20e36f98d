"""Settings of both networks: noise on features, architecture, training."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from swesbi.base.settings import Level, Settings

Deviation = Annotated[float, Field(ge=0.0)]
Procedure = Literal["sbi", "fast"]


class EmbeddingSettings(Settings):
    """A net, trained with a flow, that works out what a recording says before the flow's transforms."""

    hidden_features: int = Field(ge=1, description="Hidden units a layer. Chosen.")
    hidden_layers: int = Field(ge=1, description="Hidden layers. Chosen.")
    outputs: int = Field(
        ge=1, description="Numbers that the transforms are given beside the recording. Chosen."
    )


class FlowSettings(Settings):
    """Architecture in the terms of zuko, and how the flow is trained."""

    transforms: int = Field(
        ge=1,
        description="Autoregressive transforms, of affine maps. Chosen by held-out log-probability and "
        "importance efficiency.",
    )
    hidden_features: int = Field(ge=1, description="Hidden units a layer. Chosen likewise.")
    hidden_layers: int = Field(ge=1, description="Hidden layers a transform. Chosen likewise.")
    embedding: EmbeddingSettings | None = Field(
        default=None,
        description="A net that works out what a recording says, for all transforms; null: none. Chosen "
        "likewise.",
    )
    batch_size: int = Field(ge=2, description="Rows of a step of training. Chosen.")
    learning_rate: float = Field(gt=0.0, description="Largest of the schedule (Adam). Chosen.")
    warm_up_fraction: float = Field(
        gt=0.0, lt=1.0, description="Share of the steps in which the rate grows. Chosen."
    )
    epochs: int = Field(
        ge=1,
        description="Passes over the training theta, each with fresh noise.",
    )
    validation_fraction: float = Field(gt=0.0, lt=1.0, description="Share of the theta held out. Chosen.")
    clip_max_norm: float = Field(gt=0.0, description="Gradients are clipped to this norm. Chosen, as in sbi.")


class ObservationModelSettings(Settings):
    """Additive Gaussian noise on the features (paper, Eq. 5): diagonal, zero for every feature not named."""

    feature_noise_sd: dict[str, Deviation] = Field(
        description="Standard deviation by feature, in the unit that ends the feature's name. The values "
        "are of raw features (paper, Sec. 2.3, after Eq. 5). Features not named have no noise."
    )
    augmentations: int = Field(
        ge=1, description="N_aug, noisy copies of each simulated feature vector (paper, Sec. 2.4)."
    )


class EstimatorSettings(Settings):
    """Architecture and training of the conditional density estimator, in the terms of sbi."""

    model: Literal["maf"] = Field(
        description="Masked autoregressive flow, the default of sbi 0.26.1 (paper, Sec. 2.3)."
    )
    procedure: Procedure = Field(
        description="How training is run. fast: sbi's procedure and results, several times faster "
        "(docs/inference.md). sbi: sbi's own loop, to the bit. Either keeps the weights of the "
        "best epoch."
    )
    transforms: int = Field(ge=1, description="Autoregressive transforms (paper, Sec. 2.3).")
    hidden_features: int = Field(ge=1, description="Hidden units a layer (paper, Sec. 2.3).")
    blocks: int = Field(ge=1, description="Autoregressive blocks a transform (paper, Sec. 2.3).")
    z_score_theta: Literal["independent", "none"] = Field(
        description="Sbi's standardisation of theta. It is sbi's default, on top of the pooled "
        "standardisation (paper, Sec. 2.3)."
    )
    z_score_x: Literal["independent", "none"] = Field(
        description="Sbi's standardisation of its input. As that of theta."
    )
    batch_size: int = Field(ge=2, description="Rows of a step of training (paper, Secs. 2.3 and 2.4).")
    learning_rate: float = Field(gt=0.0, description="Of Adam. Default of sbi 0.26.1.")
    max_num_epochs: int = Field(
        ge=1,
        description="Passes over the rows, at most (paper, Sec. 2.4). It is handed to sbi as it is. Sbi "
        "stops after one epoch more and keeps that epoch's weights, here the best's are kept.",
    )
    stop_after_epochs: int = Field(
        ge=1,
        description="Epochs without improvement of the validation loss before training stops. Default of "
        "sbi 0.26.1.",
    )
    validation_fraction: Level = Field(
        description="Share of the pool's rows held out. Default of sbi 0.26.1."
    )
    clip_max_norm: float = Field(
        gt=0.0, description="Gradients are clipped to this norm. Default of sbi 0.26.1."
    )
