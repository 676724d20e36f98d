"""Files of network weights: plain data, checked before a net is built; nothing in them is executed."""

from __future__ import annotations

import io
import pickle
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Self, TypeVar

import torch
from pydantic import Field, model_validator
from torch import Tensor

from swesbi.artefacts import DamagedArtefactError, Provenance, atomic_path, read_provenance
from swesbi.artefacts.files import LENGTH, UNREADABLE, append_checksum, check_identity, check_whole
from swesbi.base.settings import Settings
from swesbi.networks.settings import EstimatorSettings
from swesbi.parameters import THETA_NAMES

METADATA: Final = "metadata"
DTYPES: Final = (torch.float32, torch.float64, torch.int64, torch.int32, torch.uint8, torch.bool)
Content = TypeVar("Content")
COMMENT_LENGTH: Final = slice(-2, None)
"""The last two bytes of a zip archive without a comment: the length of the comment."""
NOT_PLAIN: Final = (*UNREADABLE, EOFError, pickle.UnpicklingError, zipfile.BadZipFile)
EpochNumber = Annotated[int, Field(ge=1)]
Loss = Annotated[float, Field(allow_inf_nan=True)]


def check_plain(content: object) -> Mapping[str, Any]:
    """Return the content of a file of weights once it is known to be plain.

    Raises:
        ValueError: It lacks metadata, or something in it is neither plain nor a dense, finite tensor.
    """
    if not isinstance(content, dict) or not isinstance(content.get(METADATA), dict):
        raise ValueError("it has no metadata")
    for name, value in content[METADATA].items():
        if not (isinstance(name, str) and _is_plain(value)):
            raise ValueError(f"its metadata {name!r} is a {type(value).__name__}")
    for name, value in content.items():
        if name != METADATA:
            _check_tensors(str(name), value)
    return content


def _is_plain(value: object) -> bool:
    items = value if isinstance(value, list | tuple) else [value]
    return all(isinstance(item, str | int | float) for item in items)


def _check_tensors(name: str, value: object) -> None:
    if isinstance(value, dict):
        for key, item in value.items():
            if not isinstance(key, str):
                raise ValueError(f"{name!r} has a name that is no text: {key!r}")
            _check_tensors(f"{name}/{key}", item)
        return
    if not isinstance(value, Tensor):
        raise ValueError(f"{name!r} is a {type(value).__name__}, expected a tensor")
    # a tensor with strides of zero claims more numbers than the file holds
    if value.layout != torch.strided or not value.is_contiguous() or value.dtype not in DTYPES:
        raise ValueError(f"{name!r} is no dense tensor of numbers")
    if not bool(torch.isfinite(value).all()):
        raise ValueError(f"{name!r} holds numbers that are not finite")


def write_plain(path: Path, content: Mapping[str, Any]) -> None:
    """Write plain content atomically, with a checksum as the archive's comment; equal content, equal bytes.

    Raises:
        ArtefactError: The file cannot be written.
    """
    # Saved through memory: given a path, torch writes the file's name into the archive.
    buffer = io.BytesIO()
    torch.save(dict(content), buffer)
    archive = bytearray(buffer.getvalue())
    archive[COMMENT_LENGTH] = LENGTH.to_bytes(2, "little")
    with atomic_path(path) as temporary:
        temporary.write_bytes(archive)
        append_checksum(temporary)


def read_plain(path: Path, kind: str, rebuild: Callable[[Mapping[str, Any]], Content]) -> Content:
    """Read plain content with ``weights_only=True`` and rebuild from it what it holds.

    Torch reads a flipped bit without complaint, so the checksum comes first; then the content has to be
    plain, of this kind and of this schema version before anything is built from it.

    Args:
        path: The file; its content has ``metadata`` with the attributes of a provenance.
        kind: The kind that the provenance must name.
        rebuild: Makes the result from the content.

    Raises:
        DamagedArtefactError: The file was cut off or changed, is of another schema version, is not plain or
            cannot be rebuilt; the message gives the command that makes it again.
        ArtefactError: The file is missing, or is of another kind.
    """
    check_whole(path, plain_provenance)
    content, provenance = _guarded(path, kind, lambda: _content(path))
    check_identity(path, kind, provenance)
    return _guarded(path, kind, lambda: rebuild(content))


def read_content(path: Path) -> Mapping[str, Any]:
    """Return the plain content of a file, of whatever kind and version: ``metadata`` and weights.

    Raises:
        Exception: One of ``NOT_PLAIN``: the file is no such file.
    """
    if not zipfile.is_zipfile(path):
        raise ValueError("it is no archive of tensors")
    return check_plain(torch.load(path, map_location="cpu", weights_only=True))


def _content(path: Path) -> tuple[Mapping[str, Any], Provenance]:
    content = read_content(path)
    return content, read_provenance(content["metadata"])


def plain_provenance(path: Path) -> Provenance:
    """Return the provenance of a file of weights, of whatever schema version.

    Raises:
        ValueError: The file is no such file.
    """
    try:
        return _content(path)[1]
    except NOT_PLAIN as error:
        raise ValueError(str(error)) from error


def _guarded(path: Path, kind: str, read: Callable[[], Content]) -> Content:
    try:
        return read()
    except NOT_PLAIN as error:
        raise DamagedArtefactError(
            path, f"cannot be read as an artefact of kind {kind!r} ({error})"
        ) from error


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
    best_epoch: EpochNumber

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

    epochs_run: EpochNumber
    best_validation_loss: Loss


class CheckpointsMetadata(NetMetadata):
    """Metadata of ``checkpoints.pt``: one entry an epoch kept."""

    epochs: tuple[EpochNumber, ...] = Field(min_length=1)
    validation_losses: tuple[Loss, ...]


def check_size(architecture: EstimatorSettings, state: Mapping[str, Tensor]) -> None:
    """Refuse settings of a net that is far larger than the weights given for it, before it is built.

    Raises:
        ValueError: The hidden layers alone need more numbers than there are.
    """
    least = architecture.transforms * architecture.blocks * architecture.hidden_features**2
    if least > (held := sum(tensor.numel() for tensor in state.values())):
        raise ValueError(f"its settings describe a net of at least {least} weights, it holds {held}")
