"""The reference of the settings: every shipped key, ranges that are in force, and a table that is current."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import jsonschema
import pytest
from annotated_types import Ge, Gt, Le, Lt
from study_copy import ROOT

from swesbi.base.settings import Settings
from swesbi.config.models import Config
from swesbi.config.read import parts_of, read_yaml
from tools.settings import INLINE, SCHEMA, STUDIES, TABLE, allowed, main, rows, schema, table

ROWS = {row.key: row for row in rows()}
KINDS = [model.__name__ for model in INLINE]
SIGNS = {"≥": Ge, ">": Gt, "≤": Le, "<": Lt}


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


def test_every_field_has_a_row_or_stands_in_a_value_that_is_shown_whole() -> None:
    named = {key.rpartition(".")[2] for key in ROWS}
    within = " ".join(row.default for row in ROWS.values())
    fields = {key for model in MODELS for key in model.model_fields} - named
    of_ectopic_beats = {"phase_index", "repeat", "rr_ratio"}  # of which the settings have none
    assert {key for key in fields if not re.search(rf"\b{key}\b", within)} == of_ectopic_beats


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


def test_the_table_is_current_and_written_where_asked(tmp_path: Path) -> None:
    assert TABLE.read_text(encoding="utf-8") == table(), "run `python -m tools.settings`"
    assert main(["--out", str(tmp_path / "settings.csv"), "--schema", str(tmp_path / "schema.json")]) == 0
    assert (tmp_path / "settings.csv").read_text(encoding="utf-8") == table()


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
