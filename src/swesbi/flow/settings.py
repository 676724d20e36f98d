"""Architecture and training of the flow q(phi | z)."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from swesbi.settings import Settings


class FlowSettings(Settings):
    """Architecture in the terms of zuko, and how the flow is trained."""

    model: Literal["maf", "nsf"] = Field(description="masked autoregressive, or neural spline flow")
    transforms: int = Field(ge=1, description="autoregressive transforms")
    hidden_features: int = Field(ge=1, description="hidden units a layer")
    hidden_layers: int = Field(ge=1, description="hidden layers a transform")
    bins: int = Field(ge=2, description="bins of each spline; the masked autoregressive flow has none")
    batch_size: int = Field(ge=2)
    learning_rate: float = Field(gt=0.0, description="largest of the schedule (Adam)")
    warm_up_fraction: float = Field(gt=0.0, lt=1.0, description="share of the steps in which the rate grows")
    epochs: int = Field(ge=1, description="passes over the training theta, each with fresh noise")
    validation_fraction: float = Field(gt=0.0, lt=1.0, description="share of the theta held out")
    clip_max_norm: float = Field(gt=0.0, description="gradients are clipped to this norm")
