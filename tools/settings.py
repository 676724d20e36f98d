"""The reference of all settings, from their typed fields: ``python -m tools.settings`` writes its page.

A section stands for one class of settings, wherever it occurs; a row for one key: its shipped value, unit,
allowed range, and meaning with the reason of the value. Nothing of it is said elsewhere.
"""

from __future__ import annotations

import argparse
import inspect
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from studies.acquisition_seeds.settings import AcquisitionSeedsSettings
from studies.discrepancy.settings import ChoiceSettings
from studies.ladder.settings import LadderSettings, Structure
from studies.readings.settings import Reading, ReadingsSettings, Treatment
from studies.sensitivity.settings import SensitivitySettings, Variant
from studies.validation.settings import ValidationSettings
from swesbi.artefacts import atomic_path
from swesbi.base.settings import Settings
from swesbi.config.read import parse_config, parse_section, parts_of, read_merged, read_yaml
from swesbi.population.settings import Fraction, Quantity, SizedQuantity
from swesbi.prior import ParameterPrior
from swesbi.report.table import BAR

ROOT: Final = Path(__file__).parents[1]
PAGE: Final = "settings.md"
MARK: Final = "settings"
MARKED: Final = re.compile(rf"(<!-- begin {MARK}[^\n]*-->\n)(.*?)(<!-- end {MARK} -->)", re.DOTALL)
STUDIES: Final[Mapping[str, type[Settings]]] = {
    "acquisition_seeds": AcquisitionSeedsSettings,
    "discrepancy": ChoiceSettings,
    "ladder": LadderSettings,
    "readings": ReadingsSettings,
    "sensitivity": SensitivitySettings,
    "validation": ValidationSettings,
}
"""Of each side study, the class of its section."""
DISTRIBUTIONS: Final = (ParameterPrior, Quantity, SizedQuantity, Fraction)
"""Classes that say how the number of a key is distributed."""
INLINE: Final = (*DISTRIBUTIONS, Structure, Reading, Treatment, Variant)
"""Classes that occur so often that each is shown as the value of a key; their own keys stand once."""
UNITS: Final = {
    "pa_s2_m3": "Pa s2/m3", "pa_s_m3": "Pa s/m3", "m3_pa": "m3/Pa", "kg_m3": "kg/m3", "pa_s": "Pa s",
    "per_s": "1/s", "kpa": "kPa", "pa": "Pa", "mmhg": "mmHg", "ms": "ms", "s": "s", "m2": "m2", "ml": "mL",
    "cm": "cm", "bpm": "1/min", "years": "years", "cycle": "cycle", "cycles": "cycle",
}  # fmt: skip
"""Units by the end of a key, the longest first; a number without any of them has the unit 1."""
BOUNDS: Final = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
SECTION: Final = "a section"
"""Stands for the value of a key that has keys of its own."""
COLUMNS: Final = ("Key", "Shipped", "Unit", "Allowed", "Meaning and reason")


@dataclass(frozen=True)
class Row:
    """One key of a class.

    Attributes:
        key: The key.
        shipped: Its shipped value in YAML, by the place of its section; where a file gives it.
        unit: Its unit; empty where it is no number.
        allowed: Which values it may have.
        meaning: What it means, and the reason of the value.
    """

    key: str
    shipped: Mapping[str, str]
    unit: str
    allowed: str
    meaning: str


@dataclass(frozen=True)
class Section:
    """One class of settings.

    Attributes:
        file: The first file in which it occurs.
        model: The class.
        places: Where it occurs, by keys joined with points; the root is the empty text.
        rows: Its keys.
    """

    file: str
    model: type[Settings]
    places: tuple[str, ...]
    rows: tuple[Row, ...]


@dataclass
class _Found:
    """What is known of a class while files are read."""

    file: str
    given: dict[str, dict[str, str]] = field(default_factory=dict)


def sections(root: Path = ROOT) -> list[Section]:
    """Return the sections of the shipped configuration and of the side studies, file by file.

    Raises:
        ConfigError: A shipped file is not valid.
    """
    config = root / "config.yaml"
    merged = read_merged(config)
    files = {key: str(part.relative_to(root)) for part in parts_of(config) for key in read_yaml(part)}
    found: dict[tuple[str, type[Settings]], _Found] = {}
    parsed = parse_config(merged)
    for file in dict.fromkeys((config.name, *files.values())):
        _walk(parsed, {key: merged[key] for key in merged if files[key] == file}, "", file, found)
    for name, model in STUDIES.items():
        path = root / "studies" / name / "config.yaml"
        raw = read_yaml(path)[name]
        _walk(parse_section(raw, str(path), model), raw, name, str(path.relative_to(root)), found)
    return [_section(model, each) for (_, model), each in found.items()]


def _walk(
    settings: Settings, raw: Mapping[str, Any], place: str, file: str, found: dict[Any, _Found]
) -> None:
    """Note what a file gives of a class, and of those below it."""
    model = type(settings)
    # the root has a section in each file; any other class has one
    each = found.setdefault((file if not place else "", model), _Found(file))
    given = each.given.setdefault(place, {})
    below: list[tuple[Settings, Any, str]] = []
    for key in model.model_fields:
        if key not in raw:
            continue
        inside, value = f"{place}.{key}".removeprefix("."), getattr(settings, key)
        given[key] = in_yaml(raw[key])
        if isinstance(value, Settings):
            given[key] = given[key] if isinstance(value, INLINE) else SECTION
            below.append((value, raw[key], inside))
        elif isinstance(value, Mapping) and all(isinstance(one, Settings) for one in value.values()):
            given[key] = ", ".join(value)
            below += [(value[name], raw[key][name], f"{inside}.{name}") for name in value]
    for one, plain, where in below:
        _walk(one, plain, where, file, found)


def _section(model: type[Settings], found: _Found) -> Section:
    schema = model.model_json_schema()
    of_root = "" in found.given
    keys = [key for key in model.model_fields if not of_root or key in found.given[""]]
    inline = issubclass(model, INLINE)
    rows = []
    for key in keys:
        shipped = {place: given[key] for place, given in found.given.items() if key in given and not inline}
        about = schema["properties"][key]
        meaning = model.model_fields[key].description or ""
        rows.append(Row(key, shipped, unit_of(key, about), allowed(about, schema), meaning))
    return Section(found.file, model, tuple(found.given), tuple(rows))


def unit_of(key: str, about: Mapping[str, Any]) -> str:
    """Return the unit of a key: said by its field or by its end, 1 for other numbers, else none.

    Args:
        key: The key.
        about: JSON Schema of its field.
    """
    if "unit" in about:
        return str(about["unit"])
    told = next((unit for end, unit in UNITS.items() if f"_{key}".endswith(f"_{end}")), "")
    numbers = ("'type': '(?:number|integer)'", *(f"/{one.__name__}'" for one in DISTRIBUTIONS))
    numeric = re.search("|".join(numbers), str(about))
    return told or ("1" if numeric else "")


def allowed(about: Mapping[str, Any], schema: Mapping[str, Any]) -> str:
    """Say which values a field may have.

    Args:
        about: JSON Schema of the field.
        schema: That of the class, with the classes that it refers to.
    """
    if "allowed" in about:
        return str(about["allowed"])
    if "$ref" in about:
        return f"keys of {about['$ref'].rpartition('/')[2]}"
    if "anyOf" in about or "oneOf" in about:
        each = [allowed(one, schema) for one in about.get("anyOf") or about["oneOf"]]
        return " or ".join(dict.fromkeys(each))
    if "enum" in about or "const" in about:
        return " or ".join(map(in_yaml, about.get("enum", [about.get("const")])))
    kind = about.get("type", "any value")
    if kind == "array":
        return _list(about, schema)
    if kind == "object":
        named = about.get("patternProperties") or {"": about.get("additionalProperties", {})}
        return f"names, each with {allowed(next(iter(named.values())), schema)}"
    words = {"integer": "whole number", "string": "text", "boolean": "true or false"}.get(kind, kind)
    limits = [f"{sign} {in_yaml(about[bound])}" for bound, sign in BOUNDS.items() if bound in about]
    return f"{words} {' and '.join(limits)}".strip()


def _list(about: Mapping[str, Any], schema: Mapping[str, Any]) -> str:
    if "prefixItems" in about:
        return f"list of {len(about['prefixItems'])}: {allowed(about['prefixItems'][0], schema)}"
    least = f"at least {about['minItems']}: " if "minItems" in about else ""
    return f"list of {least}{allowed(about['items'], schema)}"


def in_yaml(value: object) -> str:
    """Return a value as the configuration has it, on one line."""
    if isinstance(value, bool) or value is None:
        return {True: "true", False: "false", None: "null"}[value]
    if isinstance(value, Mapping):
        inside = ", ".join(f"{key}: {in_yaml(one)}" for key, one in value.items())
        return f"{{ {inside} }}" if inside else "{}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"[{', '.join(map(in_yaml, value))}]"
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def reference(root: Path = ROOT) -> str:
    """Return the reference in Markdown.

    Raises:
        As ``sections``.
    """
    lines: list[str] = []
    each = sections(root)
    for file in dict.fromkeys(section.file for section in each):
        lines += [f"## {file}", ""]
        for section in each:
            if section.file == file:
                lines += [*_written(section), ""]
    return "\n".join(lines)


def _written(section: Section) -> Iterator[str]:
    model, places = section.model, [place for place in section.places if place]
    inline = issubclass(model, INLINE)
    if inline:
        yield f"### {model.__name__}"
    elif places:
        yield f"### {places[0]}"
    if inline or places or section.file == "config.yaml":
        yield from ("", *_docstring(model), "")
    if places[1:] and not inline:
        yield from (f"Also {', '.join(f'`{place}`' for place in places[1:])}.", "")
    yield f"| {' | '.join(COLUMNS)} |"
    yield f"|{'---|' * len(COLUMNS)}"
    for row in section.rows:
        meaning = row.meaning.replace("<", "&lt;")
        cells = (f"`{row.key}`", _shipped(row.shipped), row.unit, row.allowed, meaning)
        yield f"| {' | '.join(cell.replace('|', BAR) for cell in cells)} |"


def _docstring(model: type[Settings]) -> list[str]:
    """Return the paragraphs of the docstrings of a class and of its bases, each on one line, in Markdown."""
    classes = [one for one in model.__mro__ if issubclass(one, Settings) and one is not Settings]
    text = "\n\n".join(inspect.cleandoc(one.__doc__ or "") for one in classes)
    text = re.sub(r":\w+:`~?([^`]+)`", r"`\1`", text).replace("``", "`")
    return "\n\n".join(" ".join(part.split()) for part in text.split("\n\n")).splitlines()


def _shipped(values: Mapping[str, str]) -> str:
    """Return the shipped values of a key, each with its places where there are several."""
    places: dict[str, list[str]] = {}
    for place, value in zip(_apart(list(values)), values.values(), strict=True):
        places.setdefault(value, []).append(place)
    if len(places) < 2:
        return next(iter(places), "")
    return "<br>".join(f"{value} ({', '.join(where)})" for value, where in places.items())


def _apart(places: Sequence[str]) -> list[str]:
    """Return the part of each place in which they differ."""
    keys = [place.split(".") for place in places]
    start, end = (_same(keys), _same([each[::-1] for each in keys]))
    return [".".join(each[start : len(each) - end]) for each in keys]


def _same(keys: Sequence[Sequence[str]]) -> int:
    """Return how many first keys all have in common, fewer than any has."""
    same = (len(set(at)) == 1 for at in zip(*keys, strict=False))
    return min(next((n for n, one in enumerate(same) if not one), 0), min(map(len, keys), default=1) - 1)


def main(arguments: Sequence[str]) -> int:
    """Write the reference into its page; return 0."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.settings",
        description="Writes the reference of all settings into docs/settings.md, from their typed fields.",
    )
    parser.add_argument("--docs", type=Path, default=ROOT / "docs", help="default: docs of this project")
    page: Path = parser.parse_args(arguments).docs / PAGE
    text = MARKED.sub(
        lambda match: f"{match[1]}\n{reference().strip()}\n\n{match[3]}", page.read_text(encoding="utf-8")
    )
    with atomic_path(page) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
    print(f"wrote {page}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
