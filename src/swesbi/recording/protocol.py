"""``recording.yaml``: what a cohort says of how its recordings were made, and ``swe/<subject>.yaml`` of one.

What the second says stands in place of the first for that recording: keys of ``protocol`` one by one,
``columns``, ``units``, ``table`` and ``noise`` as wholes.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal, cast, get_args

import yaml
from pydantic import ValidationError

from swesbi.recording.cohort import PROTOCOL, RECORDINGS, SUBJECTS, check_file
from swesbi.recording.content import in_one_line, read_bytes
from swesbi.recording.layout import TableLayout, layout_of
from swesbi.recording.problems import Problem, RecordingError, raise_any
from swesbi.recording.settings import OTHERS, NoiseDeclaration, RecordingSettings

Repeats = Literal["separate", "sweeps"]
SEE_TEMPLATE: Final = "`swesbi template FOLDER` writes one to start from"
LAYOUT: Final = tuple(TableLayout.model_fields)
OVERRIDING: Final = ("protocol", *LAYOUT, "noise")
"""Keys of ``recording.yaml`` that a recording may say for itself."""
SAY_GROUPS: Final = "write a name for each group and the list of its subjects, as in `quiet: [P01, P02]`"
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
    noise: NoiseDeclaration = NoiseDeclaration()


def read_protocol(cohort: Path, settings: RecordingSettings, subject: str = "") -> Protocol:
    """Read ``recording.yaml``, which must agree with the settings of ingestion where it says the same.

    Args:
        cohort: Its folder.
        settings: Of ingestion; of one recording, with the phases that it says for itself.
        subject: Whose own file stands in its place where it says otherwise; nobody's without.

    Raises:
        RecordingError: The file is missing, no YAML mapping, lacks ``origin``, disagrees, or says of its
            repeats what is not known.
    """
    path = cohort / PROTOCOL
    check_file(path, cohort)
    plain = _of_recording(path, subject)
    origin, repeats = plain.get("origin"), _repeats(plain)
    said_in = partial(_said_in, path, subject)
    protocol = said_in("protocol")
    problems = [
        *_disagreements((path, protocol), plain, settings),
        *_problems_of_repeats(protocol, repeats),
    ]
    if not isinstance(origin, str) or not origin.strip():
        remedy = "say in a few words who or what was recorded"
        problems.append(Problem(str(path), "has no text under the key `origin`", remedy))
    elif not in_one_line(origin).isprintable():
        reason = "under the key `origin` has a sign that cannot be seen"
        problems.append(Problem(str(path), reason, "type the text anew", value=origin))
    raise_any(problems)
    layout, noise = layout_of(plain, said_in(*LAYOUT)), _noise(plain, said_in("noise"))
    return Protocol(in_one_line(str(origin)), cast("Repeats", repeats), layout, noise)


def own_protocol(cohort: Path, subject: str) -> Path:
    """Return where a recording may say what of its making differs from the cohort's."""
    return cohort / RECORDINGS / f"{subject}.yaml"


def with_own_phases(path: Path, subject: str, settings: RecordingSettings) -> RecordingSettings:
    """Return the settings with the number of gated phases that a recording says for itself, if it does.

    Args:
        path: ``recording.yaml`` of the cohort.
        subject: Whose recording it is.
        settings: Those of the cohort.

    Raises:
        RecordingError: The recording's own file cannot be used, or has no such number.
    """
    protocol = _own(path, subject).get("protocol") or {}
    phases = protocol.get("phases") if isinstance(protocol, dict) else None
    if phases is None:
        return settings
    try:
        return RecordingSettings.from_plain(settings.to_plain() | {"phases": phases})
    except ValidationError as error:
        file = str(own_protocol(path.parent, subject))
        reason = f"under the key `protocol.phases`: {error.errors()[0]['msg']}"
        raise RecordingError(Problem(file, reason, "correct it", value=str(phases))) from error


@dataclass(frozen=True)
class Said:
    """What is said of how one recording was made: by its own file, or else by its cohort's.

    Attributes:
        settings: Quality control, with as many gated phases as the recording has.
        protocol: Origin, repeats, layout and noise.
    """

    settings: RecordingSettings
    protocol: Protocol


def said_of(cohort: Path, subject: str, settings: RecordingSettings) -> Said:
    """Return what is said of a recording, which must agree with the settings where both say the same.

    Raises:
        RecordingError: A file cannot be used, or disagrees.
    """
    settings = with_own_phases(cohort / PROTOCOL, subject, settings)
    return Said(settings, read_protocol(cohort, settings, subject))


def read_repeats(path: Path, subject: str = "") -> Repeats:
    """Read from a cohort's ``recording.yaml``, or a recording's own, what repeats are, and nothing else.

    Raises:
        RecordingError: The file is missing or no YAML mapping, or says what is not known.
    """
    repeats = _repeats(_of_recording(path, subject))
    raise_any(_problems_of_repeats(_said_in(path, subject, "protocol"), repeats))
    return cast("Repeats", repeats)


def read_noise_groups(path: Path, subjects: Collection[str]) -> dict[str, str]:
    """Read from a cohort's ``recording.yaml`` which recordings have errors of their own, and nothing else.

    Args:
        path: The file. Under ``noise_groups`` stand names of groups, each with its subjects.
        subjects: All subjects of the cohort's table.

    Returns:
        The group of each subject that a group names.

    Raises:
        RecordingError: The file is missing or no YAML mapping, a group is no list of subjects, names one that
            is not in the table or that another group has, or is called as the rest.
    """
    said = _mapping(path).get("noise_groups") or {}
    if not isinstance(said, dict) or not all(isinstance(names, list) for names in said.values()):
        reason = "under the key `noise_groups` has no lists of subjects"
        raise RecordingError(Problem(str(path), reason, SAY_GROUPS, value=str(said)))
    found: dict[str, str] = {}
    problems = []
    if OTHERS in map(str, said):
        reason = f"under the key `noise_groups.{OTHERS}`: the recordings that no group names are called so"
        problems.append(Problem(str(path), reason, "give the group another name"))
    for group, name in [(str(group), str(name)) for group, names in said.items() for name in names]:
        key = f"under the key `noise_groups.{group}`"
        if name not in subjects:
            problems.append(
                Problem(str(path), f"{key} is no subject of {SUBJECTS}", "correct it", value=name)
            )
        elif found.setdefault(name, group) != group:
            problems.append(Problem(str(path), f"{key} is in {found[name]} too", "keep one", value=name))
    raise_any(problems)
    return found


def read_layout(path: Path, subject: str = "") -> TableLayout:
    """Read from a cohort's ``recording.yaml``, or a recording's own, how tables differ, and nothing else.

    Raises:
        RecordingError: The file is missing or no YAML mapping, or says what is not known.
    """
    return layout_of(_of_recording(path, subject), _said_in(path, subject, *LAYOUT))


def _of_recording(path: Path, subject: str) -> Mapping[str, Any]:
    """Return what ``recording.yaml`` says, with what the subject's own file says in its place."""
    plain, own = _mapping(path), _own(path, subject)
    protocols = plain.get("protocol"), own.get("protocol")
    whole = {**plain, **own}
    if all(isinstance(protocol, dict) for protocol in protocols):
        whole["protocol"] = {**plain["protocol"], **own["protocol"]}
    return whole


def _said_in(path: Path, subject: str, *keys: str) -> Path:
    """Return the file in which what stands under one of these keys is said."""
    own = _own(path, subject)
    return own_protocol(path.parent, subject) if any(key in own for key in keys) else path


def _own(path: Path, subject: str) -> Mapping[str, Any]:
    file = own_protocol(path.parent, subject)
    if not subject or not (file.exists() or file.is_symlink()):
        return {}
    check_file(file, path.parent)
    own = _mapping(file)
    if unknown := [str(key) for key in own if key not in OVERRIDING]:
        reason = "is no key that a recording may say for itself"
        remedy = f"those are {', '.join(OVERRIDING)}"
        raise RecordingError(Problem(str(file), reason, remedy, value=unknown[0]))
    return own


def _noise(plain: Mapping[str, Any], path: Path) -> NoiseDeclaration:
    """Return what is declared of errors; of a key ``noise`` that is left out or empty, nothing."""
    said = plain.get("noise")
    try:
        return NoiseDeclaration.from_plain({} if said is None else said)
    except (ValidationError, TypeError, ValueError) as error:
        first = error.errors()[0] if isinstance(error, ValidationError) else {"loc": (), "msg": str(error)}
        key = ".".join(["noise", *map(str, first["loc"])])
        reason = f"under the key `{key}`: {str(first['msg']).removeprefix('Value error, ')}"
        raise RecordingError(Problem(str(path), reason, "see `template`", value=str(said))) from error


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


def _disagreements(
    files: tuple[Path, Path], plain: Mapping[str, Any], settings: RecordingSettings
) -> list[Problem]:
    """Return where ``recording.yaml``, or the file with ``protocol``, differs from the settings."""
    protocol = plain.get("protocol") or {}
    if not isinstance(protocol, dict):
        return [Problem(str(files[1]), "has no keys under `protocol`", SEE_TEMPLATE)]
    said = {
        "density_kg_m3": (files[0], plain.get("density_kg_m3"), settings.density_kg_m3),
        "protocol.phases": (files[1], protocol.get("phases"), settings.phases),
    }
    return [
        Problem(
            str(file),
            f"{key} is {here!r}, but recording.{key.removeprefix('protocol.')} in config.yaml is {there:g}",
            "correct the one that is wrong",
        )
        for key, (file, here, there) in said.items()
        if here is not None and here != there
    ]
