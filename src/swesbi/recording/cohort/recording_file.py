"""``recording.yaml``: what a cohort says of how its recordings were made, and ``swe/<subject>.yaml`` of one.

What the second says stands in place of the first for that recording: keys of ``protocol`` one by one,
``columns``, ``units``, ``table`` and ``noise`` as wholes.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeVar

from pydantic import BaseModel, Field, ValidationError
from pydantic_core import ErrorDetails

from swesbi.base.settings import Settings
from swesbi.base.yaml_files import YamlError, yaml_mapping
from swesbi.recording.cohort.files import RECORDING_FILE, RECORDINGS, SUBJECTS, check_file
from swesbi.recording.problems import Problem, RecordingError, raise_any, refusal
from swesbi.recording.samples import CONFIGURED
from swesbi.recording.settings import OTHERS, NoiseDeclaration, RecordingSettings, Repeats
from swesbi.recording.tables.csv_text import read_bytes
from swesbi.recording.tables.layout import TableLayout
from swesbi.recording.tables.table import in_one_line

Fact = str | int | float | None
SEE_TEMPLATE: Final = "`swesbi template FOLDER` writes one to start from"
OWN_FACTS: Final = "remove it; facts of your own go under the key `sources`"
IN_MEMORY: Final = "the table in memory"
Section = TypeVar("Section", bound=Settings)


class MadeBy(Settings):
    """Section ``protocol``: how the recordings were made, as far as it is known."""

    system: Fact = None
    probe: Fact = None
    push_frequency_mhz: Fact = None
    push_duration_us: Fact = None
    push_f_number: Fact = None
    view: Fact = None
    region: Fact = None
    phases: int | None = None
    repeats: Fact = None
    repeats_are: Repeats = Field(
        default="separate",
        description="`sweeps` if a repeat of one number runs over all phases, else `separate`",
    )
    samples_per_repeat: Fact = None


class OwnFile(TableLayout):
    """What one recording may say for itself: ``noise`` is what is known of its errors without repeats."""

    protocol: MadeBy = MadeBy()
    noise: NoiseDeclaration = NoiseDeclaration()


class RecordingFile(OwnFile):
    """All that ``recording.yaml`` may say; ``sources`` are facts of one's own.

    ``origin`` is who or what was recorded. The density must be that of the configuration. Errors of each of
    ``noise_groups``, which has its subjects, are estimated apart.
    """

    origin: str = ""
    density_kg_m3: float | None = None
    noise_groups: dict[str, tuple[str | int, ...]] = Field(default_factory=dict)
    sources: dict[str, Any] = Field(default_factory=dict)

    @property
    def layout(self) -> TableLayout:
        """How the tables differ from this project's form."""
        return TableLayout(columns=self.columns, units=self.units, table=self.table)


@dataclass(frozen=True)
class Description:
    """What is said of how one recording was made, by its own file or else by its cohort's.

    ``settings`` have as many gated phases as the recording; ``phases_source`` is where that number is said.
    """

    settings: RecordingSettings
    file: RecordingFile
    phases_source: str = CONFIGURED


def description_of(
    cohort: Path, subject: str, settings: RecordingSettings, phases_source: str = CONFIGURED
) -> Description:
    """Return what is said of a recording, which must agree with the settings where both say the same.

    Without a subject it is what is said of all. An ``origin`` must be there.
    """
    file, own = read_recording_file(cohort, subject), _own(cohort, subject)
    path = own_file(cohort, subject)
    if (own.get("protocol") or {}).get("phases") is not None:
        settings, phases_source = _with_phases(settings, file, path), f"protocol.phases in {path}"
    _check_agreement(cohort / RECORDING_FILE, file, settings, phases_source)
    return Description(settings, file.model_copy(update={"origin": in_one_line(file.origin)}), phases_source)


def described_in_memory(said: Mapping[str, Any], settings: RecordingSettings) -> Description:
    """Return what is said of a recording in memory, in the keys of ``recording.yaml``."""
    path = Path(IN_MEMORY)
    file = validated(RecordingFile, {"origin": IN_MEMORY, **said}, path)
    if file.protocol.phases is not None:
        settings = _with_phases(settings, file, path)
    _check_agreement(path, file, settings, "protocol.phases")
    return Description(settings, file, "protocol.phases")


def _with_phases(settings: RecordingSettings, file: RecordingFile, path: Path) -> RecordingSettings:
    """Return the settings with the number of gated phases that a recording has for itself."""
    phases = file.protocol.phases
    try:
        return RecordingSettings.from_plain(settings.to_plain() | {"phases": phases})
    except ValidationError as error:
        raise refusal(
            path,
            f"under the key `protocol.phases`: {error.errors()[0]['msg']}",
            "correct it",
            value=str(phases),
        ) from error


def _check_agreement(
    path: Path, file: RecordingFile, settings: RecordingSettings, phases_source: str
) -> None:
    """Refuse a file without an origin that can be seen, or one that disagrees with the settings."""
    problems = []
    if not in_one_line(file.origin):
        remedy = "say in a few words who or what was recorded"
        problems.append(Problem(str(path), "has no text under the key `origin`", remedy))
    elif not in_one_line(file.origin).isprintable():
        reason = "under the key `origin` has a sign that cannot be seen"
        problems.append(Problem(str(path), reason, "type the text anew", value=file.origin))
    density = "recording.density_kg_m3 in config.yaml"
    said = {
        "density_kg_m3": (file.density_kg_m3, settings.density_kg_m3, density),
        "protocol.phases": (file.protocol.phases, settings.phases, phases_source),
    }
    for key, (here, there, where_said) in said.items():
        if here is not None and here != there:
            reason = f"{key} is {here:g}, but {where_said} is {there:g}"
            problems.append(Problem(str(path), reason, "correct the one that is wrong"))
    raise_any(problems)


def read_recording_file(cohort: Path, subject: str = "") -> RecordingFile:
    """Read ``recording.yaml``, with what the subject's own file says in its place."""
    path = cohort / RECORDING_FILE
    check_file(path, cohort)
    plain, own = _mapping(path), _own(cohort, subject)
    validated(RecordingFile, plain, path)
    validated(OwnFile, own, own_file(cohort, subject))
    merged = {**plain, **own}
    if plain.get("protocol") and own.get("protocol"):
        merged["protocol"] = {**plain["protocol"], **own["protocol"]}
    return validated(RecordingFile, merged, own_file(cohort, subject))


def noise_groups_of(file: RecordingFile, path: Path, subjects: Collection[str]) -> dict[str, str]:
    """Return the group of each subject that a group of ``noise_groups`` names.

    ``path`` is named by messages. Refused is a name that is not among the table's ``subjects`` or is in two
    groups, and a group that is called as the rest.
    """
    found: dict[str, str] = {}
    problems = []
    if OTHERS in file.noise_groups:
        reason = f"under the key `noise_groups.{OTHERS}`: the recordings that no group names are called so"
        problems.append(Problem(str(path), reason, "give the group another name"))
    for group, name in [(group, str(name)) for group, names in file.noise_groups.items() for name in names]:
        key = f"under the key `noise_groups.{group}`"
        if name not in subjects:
            problems.append(
                Problem(str(path), f"{key} is no subject of {SUBJECTS}", "correct it", value=name)
            )
        elif found.setdefault(name, group) != group:
            problems.append(Problem(str(path), f"{key} is in {found[name]} too", "keep one", value=name))
    raise_any(problems)
    return found


def own_file(cohort: Path, subject: str) -> Path:
    """Return where a recording may say what of its making differs from the cohort's."""
    return cohort / RECORDINGS / f"{subject}.yaml"


def _own(cohort: Path, subject: str) -> Mapping[str, Any]:
    file = own_file(cohort, subject)
    if not subject or not (file.exists() or file.is_symlink()):
        return {}
    check_file(file, cohort)
    return _mapping(file)


def _mapping(path: Path) -> dict[str, Any]:
    try:
        return yaml_mapping(read_bytes(path).decode("utf-8-sig"))
    except (YamlError, UnicodeDecodeError) as error:
        raise refusal(
            path,
            str(error) if isinstance(error, YamlError) else f"cannot be read as YAML ({error})",
            SEE_TEMPLATE,
        ) from error


def validated(model: type[Section], plain: Mapping[str, Any], path: Path) -> Section:
    """Return what these keys of a file say; what is not known of it is refused."""
    try:
        return model.from_plain(_said(plain, model))
    except ValidationError as error:
        raise RecordingError(*(_problem(path, each, model) for each in error.errors())) from error


def _said(plain: Mapping[str, Any], model: type[BaseModel]) -> dict[str, Any]:
    """Return the keys but for known ones with nothing behind them, which say nothing."""
    sections = _sections(model)
    return {
        key: _said(value, sections[key]) if key in sections and isinstance(value, dict) else value
        for key, value in plain.items()
        if value is not None or key not in model.model_fields
    }


def _sections(model: type[BaseModel]) -> dict[str, type[BaseModel]]:
    kinds = {name: field.annotation for name, field in model.model_fields.items()}
    return {
        name: kind for name, kind in kinds.items() if isinstance(kind, type) and issubclass(kind, BaseModel)
    }


def _problem(path: Path, details: ErrorDetails, model: type[BaseModel]) -> Problem:
    """Return what is wrong with a key, and what to do."""
    location = [str(part) for part in details["loc"] if part != "[key]"]
    value = None if isinstance(details["input"], dict | list | None) else str(details["input"])
    message = details["msg"].removeprefix("Value error, ")
    if details["type"] == "extra_forbidden":
        known = dict(_keys(model))
        close = difflib.get_close_matches(location[-1], known, n=1)
        meant = known.get(location[-1]) or (known[close[0]] if close else "")
        reason = f"has the key `{'.'.join(location)}`, which is not known"
        return Problem(str(path), reason, f"did you mean `{meant}`?" if meant else OWN_FACTS)
    if not location:
        key, _, message = message.partition(": ")
        location = [key]
    return Problem(str(path), f"under the key `{'.'.join(location)}`: {message}", "correct it", value=value)


def _keys(model: type[BaseModel], above: str = "") -> Iterator[tuple[str, str]]:
    """Yield the keys of a model and its sections, and each with those above it."""
    yield from ((name, f"{above}{name}") for name in model.model_fields)
    for name, section in _sections(model).items():
        yield from _keys(section, f"{above}{name}.")
