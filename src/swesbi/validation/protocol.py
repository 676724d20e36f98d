"""Checking ``recording.yaml``: how the recordings of a cohort were made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import yaml

from swesbi.recording.csv_table import read_bytes
from swesbi.recording.files import PROTOCOL, check_file
from swesbi.recording.problems import Problem, RecordingError, raise_any
from swesbi.recording.settings import RecordingSettings

SEE_TEMPLATE: Final = "`python -m swesbi template FOLDER` writes one to start from"


@dataclass(frozen=True)
class Protocol:
    """What the cohort says of its own recordings, as far as the study uses it."""

    origin: str


def read_protocol(cohort: Path, settings: RecordingSettings) -> Protocol:
    """Read ``recording.yaml``, which must agree with the settings of ingestion where it says the same.

    Raises:
        RecordingError: The file is missing, no YAML mapping, lacks ``origin``, or disagrees.
    """
    path = cohort / PROTOCOL
    check_file(path, cohort)
    plain = _mapping(path)
    origin = plain.get("origin")
    problems = [*_disagreements(path, plain, settings)]
    if not isinstance(origin, str) or not origin.strip():
        remedy = "say in a few words who or what was recorded"
        problems.append(Problem(str(path), "has no text under the key `origin`", remedy))
    raise_any(problems)
    return Protocol(str(origin).strip())


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
