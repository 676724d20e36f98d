"""Configuration errors in words: which key, what value, what is wrong, what to do."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails


class ConfigError(ValueError):
    """A configuration that cannot be run; the message lists every problem found."""


def describe(error: ValidationError, source: str, model: type[BaseModel]) -> ConfigError:
    """Turn a validation error into one line a problem: key, value, what is wrong, remedy."""
    lines = [_line(details, model) for details in error.errors(include_url=False)]
    return ConfigError(f"{source}: {len(lines)} problem(s)\n" + "\n".join(f"  - {line}" for line in lines))


def _line(details: ErrorDetails, model: type[BaseModel]) -> str:
    location = [part for part in details["loc"] if part != "[key]"]
    key = ".".join(map(str, location)) or "(whole file)"
    remedy = _remedy(details, location, model)
    message = details["msg"].removeprefix("Value error, ")
    shown = "" if _is_container(details["input"]) else f" = {details['input']!r}"
    return f"{key}{shown}: {message}{'; ' + remedy if remedy else ''}"


def _is_container(value: object) -> bool:
    return isinstance(value, dict | list)


def _remedy(details: ErrorDetails, location: Sequence[str | int], model: type[BaseModel]) -> str:
    kind = details["type"]
    if kind == "extra_forbidden":
        close = difflib.get_close_matches(str(location[-1]), _known_keys(model, location[:-1]), n=1)
        return f"did you mean {close[0]!r}?" if close else "remove this key"
    if kind == "missing":
        return "add this key (the shipped config.yaml shows it with its source)"
    if kind in {"float_type", "int_type"} and isinstance(details["input"], str):
        return "write a plain number without quotes; YAML reads 1e-3 as text, write 1.0e-3 or 0.001"
    return ""


def _known_keys(model: type[BaseModel], location: Sequence[str | int]) -> list[str]:
    """Return the keys that a settings model knows at a location of the file."""
    current: Any = model
    for part in location:
        current = _step(current, part)
    return list(current.model_fields) if _is_model(current) else []


def _step(current: Any, part: str | int) -> Any:  # noqa: ANN401
    """Return the type of one key of a model, or of any value of a mapping of models."""
    if _is_model(current):
        field = current.model_fields.get(str(part))
        current = field.annotation if field else None
    elif getattr(current, "__origin__", None) in {dict, Mapping}:
        current = current.__args__[1]
    return current


def _is_model(value: object) -> bool:
    return isinstance(value, type) and issubclass(value, BaseModel)
