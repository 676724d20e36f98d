"""The reference of all settings, from their typed fields: ``python -m tools.settings`` writes its table.

A row stands for one key: its shipped value, unit, allowed range, meaning, reason and source. The first
sentence of a field's description is its meaning, what follows is the reason. The source stands behind the
value in its file. The site shows the same rows (tools/site.py).
"""

from __future__ import annotations

import argparse
import csv
import inspect
import io
import json
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import yaml

from studies.discrepancy.settings import ChoiceSettings
from studies.sensitivity.settings import SensitivitySettings, Variant
from studies.statements.settings import Reading, StatementsSettings
from studies.validation.settings import ValidationSettings
from swesbi.artefacts import atomic_path
from swesbi.base.settings import Settings
from swesbi.config.models import Config
from swesbi.config.read import parse_config, parse_section, parts_of, read_merged, read_yaml
from swesbi.parameters import ParameterPrior
from swesbi.population.settings import Fraction, Quantity, SizedQuantity

ROOT: Final = Path(__file__).parents[1]
TABLE: Final = ROOT / "docs" / "tables" / "settings.csv"
SCHEMA: Final = ROOT / "config" / "schema.json"
"""What editors check a file of the configuration by; `config.yaml` names it in its first line."""
STUDIES: Final[Mapping[str, type[Settings]]] = {
    "discrepancy": ChoiceSettings,
    "sensitivity": SensitivitySettings,
    "statements": StatementsSettings,
    "validation": ValidationSettings,
}
"""Of each side study, the class of its section."""
DISTRIBUTIONS: Final = (ParameterPrior, Quantity, SizedQuantity, Fraction)
"""Classes that say how the number of a key is distributed."""
INLINE: Final = (*DISTRIBUTIONS, Reading, Variant)
"""Classes that occur so often that each is shown as the value of a key; their keys stand once."""
UNITS: Final = {
    "pa_s2_m3": "Pa s2/m3", "pa_s_m3": "Pa s/m3", "m3_pa": "m3/Pa", "kg_m3": "kg/m3", "pa_s": "Pa s",
    "per_s": "1/s", "kpa": "kPa", "pa": "Pa", "mmhg": "mmHg", "ms": "ms", "s": "s", "m2": "m2", "ml": "mL",
    "cm": "cm", "bpm": "1/min", "years": "years", "cycle": "cycle", "cycles": "cycle",
}  # fmt: skip
"""Units by the end of a key, the longest first; a number without any of them has the unit 1."""
BOUNDS: Final = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
SECTION: Final = "a section"
"""Stands for the allowed values of a key that has keys of its own."""
END: Final = re.compile(r"(?<=\.)(?<!\bal\.)(?<!\bSec\.) ")
"""Where a sentence ends."""


class Row(NamedTuple):
    """One key, behind those above it or behind an inline class's name, joined with points.

    The default is the shipped value in YAML. The reason is that of the value; of a section, what is in it.
    """

    file: str
    key: str
    unit: str
    default: str
    allowed: str
    meaning: str
    reason: str
    source: str = ""


def rows(root: Path = ROOT) -> list[Row]:
    """Return the rows of the shipped configuration and of the side studies, file by file."""
    config = root / "config.yaml"
    parsed = parse_config(read_merged(config))
    found: dict[str, Row] = {}
    for path in (config, *parts_of(config)[:-1]):
        _note(_walk(parsed, "", str(path.relative_to(root)), read_yaml(path)), sources(path), found)
    for name, model in STUDIES.items():
        path = root / "studies" / name / "config.yaml"
        section = parse_section(read_yaml(path)[name], str(path), model)
        _note(_walk(section, name, str(path.relative_to(root))), sources(path), found)
    return list(found.values())


def _note(walked: Iterator[Row], behind: Mapping[str, str], found: dict[str, Row]) -> None:
    """Add the rows of a file with what stands behind their values; the keys of a class stand once."""
    for row in walked:
        found.setdefault(row.key, row._replace(source=behind.get(row.key, "")))


def sources(path: Path) -> dict[str, str]:
    """Return the source behind each value of a file, by key; other values to choose stand there too."""
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()

    def below(node: yaml.Node | None, place: str) -> Iterator[tuple[str, str]]:
        for name, value in node.value if isinstance(node, yaml.MappingNode) else []:
            inside = f"{place}.{name.value}".removeprefix(".")
            comment = lines[name.start_mark.line].partition(" # ")[2]
            yield inside, "" if comment.startswith("or ") else comment
            yield from below(value, inside)

    return dict(below(yaml.compose(text), ""))


def _walk(settings: Settings, place: str, file: str, only: Mapping[str, Any] | None = None) -> Iterator[Row]:
    """Yield a row for each key of a section, or for some of them, and after it those of its own keys."""
    model = type(settings)
    schema, given = model.model_json_schema(), settings.model_dump(mode="json", exclude_unset=True)
    plain = settings.model_dump(mode="json") | given
    for key, field in model.model_fields.items():
        if only is not None and key not in only:
            continue
        value, about = getattr(settings, key), schema["properties"][key]
        inside = f"{model.__name__ if isinstance(settings, INLINE) else place}.{key}".removeprefix(".")
        several = isinstance(value, Mapping) and any(isinstance(one, Settings) for one in value.values())
        named: Mapping[str, Settings] = value if several else {}
        meaning, *reason = END.split(field.description or "", maxsplit=1)
        row = Row(
            file,
            inside,
            unit_of(key, about),
            "" if isinstance(settings, INLINE) else ", ".join(named) or in_yaml(plain[key]),
            allowed(about, schema),
            meaning,
            "".join(reason),
        )
        if isinstance(value, Settings) and not isinstance(value, INLINE):
            row = row._replace(default="", allowed=SECTION, reason=_about(type(value)))
        yield row
        if isinstance(value, Settings):
            yield from _walk(value, inside, file)
        for name, one in named.items():
            yield from _walk(one, f"{inside}.{name}", file)


def _about(model: type[Settings]) -> str:
    """Return the docstrings of a class and of its bases on one line."""
    classes = [one for one in model.__mro__ if issubclass(one, Settings) and one is not Settings]
    text = " ".join(inspect.cleandoc(one.__doc__ or "") for one in classes)
    return " ".join(re.sub(r":\w+:`~?([^`]+)`", r"`\1`", text).replace("``", "`").split())


def unit_of(key: str, about: Mapping[str, Any]) -> str:
    """Return the unit of a key: of its field's JSON Schema or of its end, 1 for other numbers, else none."""
    if "unit" in about:
        return str(about["unit"])
    told = next((unit for end, unit in UNITS.items() if f"_{key}".endswith(f"_{end}")), "")
    numbers = ("'type': '(?:number|integer)'", *(f"/{one.__name__}'" for one in DISTRIBUTIONS))
    numeric = re.search("|".join(numbers), str(about))
    return told or ("1" if numeric else "")


def allowed(about: Mapping[str, Any], schema: Mapping[str, Any]) -> str:
    """Say which values a field may have, by its JSON Schema and that of its class."""
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


def table(root: Path = ROOT) -> str:
    """Return the reference as a table of comma-separated values."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows([Row._fields, *rows(root)])
    return text.getvalue()


def schema() -> str:
    """Return the JSON Schema of any file of the configuration: of keys and values, whichever keys it has."""

    def partly(node: Any) -> Any:  # noqa: ANN401
        if isinstance(node, list):
            return [partly(each) for each in node]
        if not isinstance(node, dict):
            return node
        return {key: partly(value) for key, value in node.items() if key != "required"}

    whole = {"$schema": "https://json-schema.org/draft/2020-12/schema", **partly(Config.model_json_schema())}
    return json.dumps(whole, indent=1, ensure_ascii=False) + "\n"


def main(arguments: Sequence[str]) -> int:
    """Write the reference, and the schema for editors; return 0."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.settings",
        description="Writes the reference of all settings, from their typed fields.",
    )
    parser.add_argument("--out", type=Path, default=TABLE, help="default: docs/tables/settings.csv")
    parser.add_argument("--schema", type=Path, default=SCHEMA, help="default: config/schema.json")
    options = parser.parse_args(arguments)
    for path, text in ((options.out, table()), (options.schema, schema())):
        with atomic_path(path) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="\n")
        print(f"wrote {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
