"""``recording.yaml``: what a cohort says of how its recordings were made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, cast, get_args

import yaml

from swesbi.recording.cohort import PROTOCOL, check_file
from swesbi.recording.layout import TableLayout, layout_of
from swesbi.recording.problems import Problem, RecordingError, raise_any
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.table import read_bytes

Repeats = Literal["separate", "sweeps"]
SEE_TEMPLATE: Final = "`swesbi template FOLDER` writes one to start from"
SAY_REPEATS: Final = (
    "write `sweeps` if a repeat of one number runs over all phases, `separate` or nothing if each phase is "
    "repeated by itself"
)


@dataclass(frozen=True)
class Protocol:
    """What the cohort says of its own recordings, as far as the study uses it.

    Attributes:
        origin: Who or what was recorded.
        repeats_are: "separate" where each phase is repeated by itself, "sweeps" where a repeat runs over all.
        layout: How its tables differ from this project's form.
    """

    origin: str
    repeats_are: Repeats = "separate"
    layout: TableLayout = TableLayout()


def read_protocol(cohort: Path, settings: RecordingSettings) -> Protocol:
    """Read ``recording.yaml``, which must agree with the settings of ingestion where it says the same.

    Raises:
        RecordingError: The file is missing, no YAML mapping, lacks ``origin``, disagrees, or says of its
            repeats what is not known.
    """
    path = cohort / PROTOCOL
    check_file(path, cohort)
    plain = _mapping(path)
    origin, repeats = plain.get("origin"), _repeats(plain)
    problems = [*_disagreements(path, plain, settings), *_problems_of_repeats(path, repeats)]
    if not isinstance(origin, str) or not origin.strip():
        remedy = "say in a few words who or what was recorded"
        problems.append(Problem(str(path), "has no text under the key `origin`", remedy))
    raise_any(problems)
    return Protocol(str(origin).strip(), cast("Repeats", repeats), layout_of(plain, path))


def read_repeats(path: Path) -> Repeats:
    """Read from a cohort's ``recording.yaml`` what its repeats are, and nothing else.

    Raises:
        RecordingError: The file is missing or no YAML mapping, or says what is not known.
    """
    repeats = _repeats(_mapping(path))
    raise_any(_problems_of_repeats(path, repeats))
    return cast("Repeats", repeats)


def read_layout(path: Path) -> TableLayout:
    """Read from a cohort's ``recording.yaml`` how its tables differ, and nothing else.

    Raises:
        RecordingError: The file is missing or no YAML mapping, or says what is not known.
    """
    return layout_of(_mapping(path), path)


def _mapping(path: Path) -> Mapping[str, Any]:
    try:
        plain = yaml.safe_load(read_bytes(path).decode("utf-8-sig"))
    # a ValueError for text that is no UTF-8, and for dates that are none
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        reason = " ".join(f"cannot be read as YAML ({error})".split())
        raise RecordingError(Problem(str(path), reason, SEE_TEMPLATE)) from error
    if not isinstance(plain, dict):
        reason = f"holds {type(plain).__name__}, expected keys with values"
        raise RecordingError(Problem(str(path), reason, SEE_TEMPLATE))
    return plain


def _repeats(plain: Mapping[str, Any]) -> object:
    """Return what is said of the repeats; a key that is left out or empty means that they are separate."""
    protocol = plain.get("protocol")
    said = protocol.get("repeats_are") if isinstance(protocol, dict) else None
    return "separate" if said is None else said


def _problems_of_repeats(path: Path, repeats: object) -> list[Problem]:
    if repeats in get_args(Repeats):
        return []
    reason = f"under the key `protocol.repeats_are` is none of {', '.join(get_args(Repeats))}"
    return [Problem(str(path), reason, SAY_REPEATS, value=str(repeats))]


def _disagreements(path: Path, plain: Mapping[str, Any], settings: RecordingSettings) -> list[Problem]:
    protocol = plain.get("protocol") or {}
    if not isinstance(protocol, dict):
        return [Problem(str(path), "has no keys under `protocol`", SEE_TEMPLATE)]
    said = {
        "density_kg_m3": ("density_kg_m3", plain.get("density_kg_m3"), settings.density_kg_m3),
        "protocol.phases": ("phases", protocol.get("phases"), settings.phases),
    }
    return [
        Problem(
            str(path),
            f"{key} is {here!r}, but recording.{name} in config.yaml is {there:g}",
            "correct the one that is wrong",
        )
        for key, (name, here, there) in said.items()
        if here is not None and here != there
    ]
