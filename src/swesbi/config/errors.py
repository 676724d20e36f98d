"""Configuration errors in words: which key, what value, what is wrong, what to do."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails


class ConfigError(ValueError):
    """A configuration that cannot be run; the message lists every problem found."""


def describe(error: ValidationError, source: str, model: type[BaseModel]) -> ConfigError:
    """Turn a validation error into one line a problem: key, value, what is wrong, remedy."""
    lines = [_line(details, model) for details in error.errors(include_url=False)]
    return ConfigError(f"{source}: {len(lines)} problem(s)\n" + "\n".join(f"  - {line}" for line in lines))


def _line(details: ErrorDetails, model: type[BaseModel]) -> str:
    location = _location(details["loc"])
    key = ".".join(map(str, location)) or "(whole file)"
    remedy = _remedy(details, location, model)
    message = details["msg"].removeprefix("Value error, ")
    shown = "" if _is_container(details["input"]) else f" = {details['input']!r}"
    return f"{key}{shown}: {message}{'; ' + remedy if remedy else ''}"


def _location(parts: Sequence[str | int]) -> list[str | int]:
    """Return the keys as they stand in the file: pydantic puts the kind of an experiment behind its name."""
    keys = [part for part in parts if part != "[key]"]
    return keys[:2] + keys[3:] if keys[:1] == ["experiments"] and len(keys) > 2 else keys


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
    types: list[Any] = [model]
    for part in location:
        types = [found for current in types for found in _step(current, part)]
    return [key for found in types if _is_model(found) for key in found.model_fields]


def _step(current: Any, part: str | int) -> tuple[Any, ...]:  # noqa: ANN401
    """Return the types that one key of a model, or a value of a mapping of models, may have."""
    if _is_model(current):
        field = current.model_fields.get(str(part))
        return (field.annotation,) if field else ()
    if get_origin(current) in {dict, Mapping}:
        value = get_args(current)[1]
        return get_args(get_args(value)[0]) if get_origin(value) is Annotated else (value,)
    return ()


def _is_model(value: object) -> bool:
    return isinstance(value, type) and issubclass(value, BaseModel)
