"""What the metadata of an estimator and of checkpoints have to say, checked before a net is built."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Self

from pydantic import Field, model_validator
from torch import Tensor

from swesbi.inference.plain_content import count_numbers
from swesbi.inference.settings import EstimatorSettings
from swesbi.parameters import THETA_NAMES
from swesbi.settings import Settings

Epoch = Annotated[int, Field(ge=1)]
Loss = Annotated[float, Field(allow_inf_nan=True)]


class NetMetadata(Settings):
    """Provenance of a file of weights, and what its net is built from.

    ``settings`` and ``estimator`` are settings as JSON.
    """

    kind: str
    schema_version: int
    subject: str
    seed: int
    settings: str
    package_version: str
    code_hash: str
    estimator: str
    parameters: tuple[str, ...]
    components: tuple[str, ...] = Field(min_length=1)
    best_epoch: Epoch

    @model_validator(mode="after")
    def _check_names(self) -> Self:
        if self.parameters != THETA_NAMES:
            raise ValueError(f"parameters {list(self.parameters)}, expected {list(THETA_NAMES)}")
        if len(set(self.components)) < len(self.components):
            raise ValueError("a component is named twice")
        return self

    def architecture(self) -> EstimatorSettings:
        """Return the settings of the net.

        Raises:
            pydantic.ValidationError: The file's settings are not an estimator's.
        """
        return EstimatorSettings.model_validate_json(self.estimator)


class EstimatorMetadata(NetMetadata):
    """Metadata of ``estimator.pt``."""

    epochs_run: Epoch
    best_validation_loss: Loss


class CheckpointsMetadata(NetMetadata):
    """Metadata of ``checkpoints.pt``: one entry an epoch kept."""

    epochs: tuple[Epoch, ...] = Field(min_length=1)
    validation_losses: tuple[Loss, ...]


def check_size(architecture: EstimatorSettings, state: Mapping[str, Tensor]) -> None:
    """Refuse settings of a net that is far larger than the weights given for it, before it is built.

    Raises:
        ValueError: The hidden layers alone need more numbers than there are.
    """
    least = architecture.transforms * architecture.blocks * architecture.hidden_features**2
    if least > (held := count_numbers(state)):
        raise ValueError(f"its settings describe a net of at least {least} weights, it holds {held}")
