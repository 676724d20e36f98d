"""Reading ``config.yaml`` and the folder ``config`` beside it; errors say where, what value, what to do."""

from __future__ import annotations

import argparse
import difflib
import json
import os
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final, TypeVar, get_args, get_origin

import yaml
from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from swesbi.base.yaml_files import SAFE, YamlError, read_yaml_mapping, yaml_mapping
from swesbi.config.models import Config

CONFIGURATION: Final = "config.yaml"
SHIPPED: Final = "shipped"
"""Of the package in a wheel: the configuration and the recordings of the demonstration (setup.py)."""
FOLDER: Final = "config"
"""Beside the configuration: what a study sets more seldom, a file a concern."""
DATA: Final = ("cohort",)
"""The keys of the configuration that name folders of recordings."""
FOLDERS: Final = (*DATA, "results", "networks")
"""The keys of the configuration that name folders."""


Section = TypeVar("Section", bound=BaseModel)


class ConfigError(ValueError):
    """A configuration that cannot be run; the message lists every problem found."""


def _line(details: ErrorDetails, model: type[BaseModel], files: Sequence[Path], section: str) -> str:
    location = _location(details["loc"])
    whole = [section, *location] if section else location
    key = ".".join(map(str, whole)) or "(whole file)"
    remedy = _remedy(details, location, model)
    unknown = details["type"] == "extra_forbidden"
    message = "no such key" if unknown else details["msg"].removeprefix("Value error, ")
    shown = "" if isinstance(details["input"], dict | list) else f" = {details['input']!r}"
    place = _place(whole, files)
    return f"{key}{shown}: {message}{'; ' + remedy if remedy else ''}{f' ({place})' if place else ''}"


def _place(location: Sequence[str | int], files: Sequence[Path]) -> str:
    """Return file and line of a key, in the last file that has it; nothing where none has."""
    for path in reversed(files):
        node: yaml.Node | None = yaml.compose(path.read_text(encoding="utf-8"), Loader=SAFE)
        line = 0
        for key in location:
            pairs = node.value if isinstance(node, yaml.MappingNode) else []
            found = [(name, value) for name, value in pairs if name.value == str(key)]
            if not found:
                break
            name, node = found[-1]
            line = name.start_mark.line + 1
        else:
            if line:
                return f"{os.path.relpath(path)}:{line}"
    return ""


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
    """Read a YAML mapping."""
    try:
        return read_yaml_mapping(path)
    except OSError as error:
        raise ConfigError(f"{path}: {_unreadable(path, error)}") from error
    except YamlError as error:
        raise ConfigError(f"{path}: {error}") from error


def _unreadable(path: Path, error: OSError) -> str:
    if isinstance(error, FileNotFoundError):
        return "there is no such file; correct the path, or name the configuration by --config"
    if isinstance(error, IsADirectoryError):
        return f"is a folder; name the file in it ({path / CONFIGURATION})"
    return f"cannot be read ({error.strerror or error}); check the file's permissions"


def at_configuration(options: argparse.Namespace) -> argparse.Namespace:
    """Return the options of a command that reads the configuration, and go to the configuration's folder.

    There the paths in it mean what they mean to the workflow. Those of the command line count from where it
    was typed.
    """
    typed_in = Path.cwd()
    config = found_configuration(options.config)
    if (home := config.parent.resolve()) != typed_in.resolve():
        for name, value in vars(options).items():
            setattr(options, name, _from(typed_in, value))
        os.chdir(home)
    options.config = Path(config.name)
    return options


def _from(folder: Path, value: object) -> object:
    """Return a path, or a list of them, as seen from anywhere; other values as they are."""
    if isinstance(value, list):
        return [_from(folder, item) for item in value]
    return folder / value if isinstance(value, Path) else value


def found_configuration(given: Path | None) -> Path:
    """Return the configuration: the given one, or that of this folder, or that of the installed project."""
    if given is not None:
        return given
    here, installed = Path(CONFIGURATION), installation() / CONFIGURATION
    return here if here.exists() or not installed.is_file() else installed


def installation() -> Path:
    """Return the checkout in which the package lies, or what a wheel ships of one."""
    package = Path(__file__).parents[1]
    checkout = package.parents[1]
    return checkout if (checkout / CONFIGURATION).is_file() else package / SHIPPED


def parts_of(config: Path) -> list[Path]:
    """Return the files of a configuration in the order in which they are merged; itself is the last.

    The others are those of the folder ``config`` beside it, or else beside that of the installed project.
    """
    beside = config.parent / FOLDER
    folder = beside if beside.is_dir() else installation() / FOLDER
    return [*sorted(folder.glob("*.yaml")), config]


def read_merged(config: Path, changes: Path | None = None) -> dict[str, Any]:
    """Read the files of a configuration and put another file over them, if there is one."""
    raw: dict[str, Any] = {}
    for path in merged_files(config, changes):
        own = read_yaml(path)
        if path == changes:
            relocate(own, path, config.parent)
        raw = overlay(raw, own)
    return raw


def relocate(merged: dict[str, Any], path: Path, home: Path, folders: Sequence[str] = FOLDERS) -> None:
    """Have the folders that a file names count from its own, if it lies outside ``home``, in place.

    Those of a file within count from ``home``, as in the workflow. What other files or the command line say
    in the merged configuration stays.
    """
    # read in any case: of two equal keys Snakemake, which has merged the file, takes the last
    own = read_merged(path) if path.name == CONFIGURATION else read_yaml(path)
    if path.resolve().is_relative_to(home.resolve()):
        return
    above = path.resolve().parent
    for key in folders:
        said = own.get(key)
        if isinstance(said, str) and merged.get(key) == said:
            merged[key] = str(above / said)
    if isinstance(own.get("experiments"), dict) and isinstance(merged.get("experiments"), dict):
        _relocate_lists(merged, own["experiments"], above)


def _relocate_lists(merged: dict[str, Any], experiments: Mapping[str, Any], above: Path) -> None:
    """Have the cohorts by which experiments list their subjects count from a folder, in place."""
    for name, part in experiments.items():
        listed = part.get("subjects") if isinstance(part, dict) else None
        now = merged["experiments"].get(name)
        if isinstance(listed, dict) and isinstance(now, dict) and now.get("subjects") == listed:
            moved = {"subjects": {str(above / folder): names for folder, names in listed.items()}}
            merged["experiments"] = merged["experiments"] | {name: now | moved}


def typed_again(merged: dict[str, Any], said: Sequence[str]) -> dict[str, Any]:
    """Return a configuration with the ``KEY=VALUE`` of Snakemake's ``--config`` as YAML has them.

    Snakemake reads a number within braces or brackets as text. What has none is left as Snakemake reads it.
    """
    for key, _, value in (one.partition("=") for one in said):
        if not value.startswith(("{", "[")):
            continue
        try:
            merged = overlay(merged, yaml_mapping(f"{key}: {value}"))
        except YamlError as error:
            raise ConfigError(
                f"--config {key}={value}: cannot be read as YAML; close its brackets"
            ) from error
    return merged


def merged_files(config: Path, changes: Path | None) -> list[Path]:
    """Return the files that :func:`read_merged` reads, in their order."""
    return [*parts_of(config), *([changes] if changes else [])]


def in_words(config: Path, changes: Path | None) -> str:
    """Return where a configuration stands, for messages."""
    return f"{config} with {changes} merged over it" if changes else str(config)


def snakemake_options(config: Path, changes: Path | None) -> str:
    """Return what Snakemake, which reads ``config.yaml`` by itself, is given for the same configuration."""
    given = [path for path in (config, changes) if path and path != Path(CONFIGURATION)]
    return shlex.join(["--configfile", *map(str, given)]) if given else ""


def parse_config(raw: Mapping[str, Any], source: str = "config.yaml", files: Sequence[Path] = ()) -> Config:
    """Validate a configuration as read from YAML; ``files`` are those that were merged."""
    return parse_section(raw, source, Config, files)


def parse_section(
    raw: object, source: str, model: type[Section], files: Sequence[Path] = (), section: str = ""
) -> Section:
    """Validate a section of the configuration, that of a side study for instance.

    ``files`` are those that were merged, the last of which wins; ``section`` is its key in them, empty of the
    whole. The error lists every problem with key, value, remedy, file and line.
    """
    try:
        return model.model_validate_json(json.dumps(raw, default=str))
    except ValidationError as error:
        lines = [_line(details, model, files, section) for details in error.errors(include_url=False)]
        listed = "".join(f"\n  - {line}" for line in lines)
        raise ConfigError(f"{source}: {len(lines)} problem(s){listed}") from error


def overlay(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return ``base`` with ``changes`` put over it, mapping by mapping, as Snakemake merges config files."""
    merged = dict(base)
    for key, value in changes.items():
        below: Any = merged.get(key)
        both = isinstance(below, Mapping) and isinstance(value, Mapping)
        merged[key] = overlay(below, value) if both else value
    return merged
