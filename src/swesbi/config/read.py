"""Reading ``config.yaml`` into its model."""

from __future__ import annotations

import argparse
import json
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from swesbi.config.errors import ConfigError, describe
from swesbi.config.models import Config


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
