"""The reference of the settings: every shipped key, ranges that are in force, and a table that is current."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from annotated_types import Ge, Gt, Le, Lt
from study_copy import ROOT

from swesbi.base.settings import Settings
from swesbi.config.models import Config
from swesbi.config.read import overlay, parts_of, read_merged, read_yaml
from tools.settings import INLINE, SCHEMA, STUDIES, TABLE, allowed, main, rows, schema, table

ROWS = {row.key: row for row in rows()}
KINDS = [model.__name__ for model in INLINE]
SIGNS = {"≥": Ge, ">": Gt, "≤": Le, "<": Lt}
FILES = [*parts_of(ROOT / "config.yaml"), *(ROOT / "studies" / name / "config.yaml" for name in STUDIES)]


def keys_of(value: object, place: str = "") -> Iterator[tuple[str, str]]:
    """Yield every key below a value, with the place of what holds it."""
    if isinstance(value, Mapping):
        for key, below in value.items():
            yield place, str(key)
            yield from keys_of(below, f"{place}.{key}".removeprefix("."))


def shipped() -> dict[str, Any]:
    studies = {name: read_yaml(ROOT / "studies" / name / "config.yaml")[name] for name in STUDIES}
    return read_merged(ROOT / "config.yaml") | studies


def lacking(given: Mapping[str, Any]) -> list[str]:
    """Return the keys of a configuration that the reference does not have."""
    found = []
    for place, key in keys_of(given):
        whole = f"{place}.{key}".removeprefix(".")
        above = [row for row in ROWS.values() if whole.startswith(f"{row.key}.")]
        named = any(row.startswith(f"{whole}.") for row in ROWS) or ".changes" in place
        # within a value that is shown whole, or of an inline class
        within = any(re.search(rf"(?:^|\W){re.escape(key)}\b", row.default) for row in above)
        inline = any(kind in row.allowed for row in above for kind in KINDS)
        of_kind = inline and any(f"{kind}.{key}" in ROWS for kind in KINDS)
        if not (whole in ROWS or named or within or of_kind):
            found.append(whole)
    return found


def test_every_shipped_key_has_a_row_or_stands_in_a_value() -> None:
    assert lacking(shipped()) == []
    more = {"recording": {"fases": 20}, "priors": {"wide": {"k0_kpa": {"middle": 1.0}}}, "colour": "red"}
    assert lacking(overlay(shipped(), more)) == ["priors.wide.k0_kpa.middle", "recording.fases", "colour"]


def test_every_row_has_a_meaning_and_every_number_a_unit() -> None:
    for row in ROWS.values():
        assert row.meaning.endswith("."), row
        assert row.unit or "number" not in row.allowed, row


def below(model: type[Settings]) -> Iterator[type[Settings]]:
    for one in model.__subclasses__():
        yield one
        yield from below(one)


NAMES = {name for model in (Config, *STUDIES.values()) for name in model.model_json_schema().get("$defs", {})}
MODELS = [Config, *STUDIES.values(), *(model for model in below(Settings) if model.__name__ in NAMES)]


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.__name__)
def test_the_range_that_is_shown_is_in_force(model: type[Settings]) -> None:
    schema = model.model_json_schema()
    for key, field in model.model_fields.items():
        shown = allowed(schema["properties"][key], schema)
        in_force = {(type(one), limit_of(one)) for one in field.metadata if type(one) in SIGNS.values()}
        of_items = shown.startswith(("list", "names", "["))
        limits = set() if of_items else set(re.findall(r"([≥>≤<]) (-?[\d.e+-]+)", shown))
        assert {(SIGNS[sign], float(limit)) for sign, limit in limits} == in_force, (key, shown)


def limit_of(constraint: object) -> float:
    return float(getattr(constraint, type(constraint).__name__.lower()))


def test_ranges_of_items_and_of_several_types_are_shown() -> None:
    shown = {key: row.allowed for key, row in ROWS.items()}
    assert shown["experiments.paper.recovery.nominal_levels"] == "list of at least 1: number > 0 and < 1"
    assert shown["new_subjects.phases"] == "whole number ≥ 8 and ≤ 60 or null"
    assert shown["forward_model.geometry"] == "midwall or thin"
    assert shown["recording.late_diastolic_window"] == "[start, end] with 0 ≤ start < end ≤ 1"
    noise = "experiments.paper.observation_model.feature_noise_sd"
    assert shown[noise] == "names, each with number ≥ 0"


def test_a_row_has_meaning_reason_and_source_apart() -> None:
    row = ROWS["recording.outlier_max_abs_z"]
    assert row.file == "config.yaml" and row.default == "3.5" and row.unit == "1"
    assert row.meaning == "Largest robust z-score, against the phase median, of an accepted speed."
    assert row.reason.startswith("It is the modified z-score") and row.source == "Iglewicz and Hoaglin 1993"


def test_the_table_is_current() -> None:
    assert TABLE.read_text(encoding="utf-8") == table(), "run `python -m tools.settings`"


def test_the_table_is_written_where_asked(tmp_path: Path) -> None:
    assert main(["--out", str(tmp_path / "settings.csv"), "--schema", str(tmp_path / "schema.json")]) == 0
    assert (tmp_path / "settings.csv").read_text(encoding="utf-8") == table()


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_files_of_settings_hold_a_key_a_line_and_short_sources(path: Path) -> None:
    lines = path.read_text(encoding="utf-8").splitlines()
    comments = [number for number, line in enumerate(lines) if line.lstrip().startswith("#")]
    assert comments == list(range(len(comments))) and len(comments) <= 4
    sources = (line.rpartition(" # ")[2] for line in lines if " # " in line)
    assert all(len(source) <= 60 for source in sources)


def test_a_class_that_is_shown_whole_has_its_keys_once() -> None:
    whole = {key.partition(".")[0] for key in ROWS if key[0].isupper()}
    assert whole == set(KINDS)


def test_editors_check_each_file_of_the_configuration_by_a_schema_that_is_current() -> None:
    assert SCHEMA.read_text(encoding="utf-8") == schema(), "python -m tools.settings"
    check = jsonschema.Draft202012Validator(json.loads(schema()))
    for path in [*parts_of(ROOT / "config.yaml"), *(ROOT / "config" / "overlays").glob("*.yaml")]:
        named = path.read_text(encoding="utf-8").partition("$schema=")[2].partition("\n")[0]
        assert (path.parent / named).resolve() == SCHEMA
        assert list(check.iter_errors(read_yaml(path))) == []
    wrong = {"sed": 1, "recording": {"min_fit_r2": 2.0}, "experiments": {"paper": {"prior": 3}}}
    places = {".".join(map(str, error.path)) for error in check.iter_errors(wrong)}
    assert {"", "recording.min_fit_r2"} < places
