"""Settings of both networks: noise on features, architecture, training."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from swesbi.base.settings import Level, Settings

Deviation = Annotated[float, Field(ge=0.0)]
Procedure = Literal["sbi", "fast"]


class EmbeddingSettings(Settings):
    """A net, trained with a flow, that works out what a recording says before the flow's transforms."""

    hidden_features: int = Field(ge=1, description="hidden units a layer")
    hidden_layers: int = Field(ge=1, description="hidden layers")
    outputs: int = Field(ge=1, description="numbers that the transforms are given beside the recording")


class SplineSettings(Settings):
    """Architecture in the terms of zuko, and how the flow is trained."""

    transforms: int = Field(ge=1, description="autoregressive transforms, of affine maps")
    hidden_features: int = Field(ge=1, description="hidden units a layer")
    hidden_layers: int = Field(ge=1, description="hidden layers a transform")
    embedding: EmbeddingSettings | None = Field(default=None, description="null: none")
    batch_size: int = Field(ge=2)
    learning_rate: float = Field(gt=0.0, description="largest of the schedule (Adam)")
    warm_up_fraction: float = Field(gt=0.0, lt=1.0, description="share of the steps in which the rate grows")
    epochs: int = Field(ge=1, description="passes over the training theta, each with fresh noise")
    validation_fraction: float = Field(gt=0.0, lt=1.0, description="share of the theta held out")
    clip_max_norm: float = Field(gt=0.0, description="gradients are clipped to this norm")


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
    procedure: Procedure = Field(
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
