"""The JSON Schema of ``config.yaml``: true of the shipped configurations, and able to refuse."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from study_copy import ROOT

from swesbi.config.read import overlay, read_merged, read_yaml
from tools.schema import config_schema, main

SCHEMA = config_schema()


def problems(config: dict[str, Any]) -> list[str]:
    validator = jsonschema.Draft202012Validator(SCHEMA)
    # pydantic reads the configuration as JSON, in which no tuple is
    return [error.message for error in validator.iter_errors(json.loads(json.dumps(config)))]


def test_the_schema_is_one_and_is_written_where_asked(tmp_path: Path) -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    path = tmp_path / "schema.json"
    assert main([str(path)]) == 0
    assert json.loads(path.read_text(encoding="utf-8")) == SCHEMA


def test_shipped_configurations_are_valid() -> None:
    shipped = read_merged(ROOT / "config.yaml")
    assert problems(shipped) == []
    assert problems(overlay(shipped, read_yaml(ROOT / "tests" / "smoke.yaml"))) == []


def unknown_key(config: dict[str, Any]) -> None:
    config["recording"]["fases"] = 20


def missing_key(config: dict[str, Any]) -> None:
    del config["experiments"]["paper"]["prior"]


def wrong_type(config: dict[str, Any]) -> None:
    config["seed"] = "20260"


def out_of_range(config: dict[str, Any]) -> None:
    config["measurement"]["grid_points"] = 3


def unknown_option(config: dict[str, Any]) -> None:
    config["forward_model"]["geometry"] = "cube"


@pytest.mark.parametrize(
    ("break_it", "said"),
    [
        (unknown_key, "'fases'"),
        (missing_key, "not valid under any"),
        (wrong_type, "'20260' is not of type 'integer'"),
        (out_of_range, "3 is less than the minimum of 20"),
        (unknown_option, "'cube' is not one of"),
    ],
)
def test_a_wrong_configuration_is_refused(break_it: Callable[[dict[str, Any]], None], said: str) -> None:
    config = read_merged(ROOT / "config.yaml")
    break_it(config)
    assert any(said in message for message in problems(config)), problems(config)
