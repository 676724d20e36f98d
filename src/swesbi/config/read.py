"""Reading ``config.yaml`` into its model; errors say which key, what value, what is wrong, what to do."""

from __future__ import annotations

import argparse
import difflib
import json
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin

import yaml
from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from swesbi.config.models import Config


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
    shown = "" if isinstance(details["input"], dict | list) else f" = {details['input']!r}"
    return f"{key}{shown}: {message}{'; ' + remedy if remedy else ''}"


def _location(parts: Sequence[str | int]) -> list[str | int]:
    """Return the keys as they stand in the file: pydantic puts the kind of an experiment behind its name."""
    keys = [part for part in parts if part != "[key]"]
    return keys[:2] + keys[3:] if keys[:1] == ["experiments"] and len(keys) > 2 else keys


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
        types = [below for current in types for below in _step(current, part)]
    return [key for current in types if _is_model(current) for key in current.model_fields]


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


def read_yaml(path: Path) -> dict[str, Any]:
    """Read a YAML mapping.

    Raises:
        ConfigError: The file cannot be read, is not YAML, or is not a mapping.
    """
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ConfigError(f"{path}: cannot be read as YAML: {error}") from error
    if not isinstance(content, dict):
        raise ConfigError(f"{path}: holds {type(content).__name__}, expected keys with values")
    return content


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add ``--config`` and ``--overlay``, whose values :func:`read_merged` takes."""
    parser.add_argument("--config", type=Path, default=Path("config.yaml"), help="default: config.yaml")
    parser.add_argument("--overlay", type=Path, help="configuration merged over it (tests/smoke.yaml, say)")


def read_merged(config: Path, changes: Path | None) -> dict[str, Any]:
    """Read a configuration and put another file's over it, if there is one.

    Raises:
        ConfigError: A file cannot be read, is not YAML, or is not a mapping.
    """
    raw = read_yaml(config)
    return overlay(raw, read_yaml(changes)) if changes else raw


def snakemake_options(config: Path, changes: Path | None) -> str:
    """Return what Snakemake, which reads ``config.yaml`` by itself, is given for the same configuration."""
    given = [path for path in (config, changes) if path and path != Path("config.yaml")]
    return shlex.join(["--configfile", *map(str, given)]) if given else ""


def parse_config(raw: Mapping[str, Any], source: str = "config.yaml") -> Config:
    """Validate a configuration as read from YAML.

    Raises:
        ConfigError: Lists every problem with key, value and remedy.
    """
    try:
        return Config.model_validate_json(json.dumps(raw, default=str))
    except ValidationError as error:
        raise describe(error, source, Config) from error


def overlay(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return ``base`` with ``changes`` put over it, mapping by mapping, as Snakemake merges config files."""
    merged = dict(base)
    for key, value in changes.items():
        below = merged.get(key)
        nested = isinstance(value, Mapping) and isinstance(below, Mapping)
        merged[key] = overlay(below, value) if nested and isinstance(below, Mapping) else value
    return merged
