"""What a file of weights may hold: metadata of texts, numbers and lists of them, and named dense tensors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import torch
from torch import Tensor

METADATA: Final = "metadata"
DTYPES: Final = (torch.float32, torch.float64, torch.int64, torch.int32, torch.uint8, torch.bool)


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


def count_numbers(state: Mapping[str, Tensor]) -> int:
    """Return how many numbers the tensors of a state_dict hold."""
    return sum(tensor.numel() for tensor in state.values())


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
