"""What a later file leaves out of a side study, by null in place of a variant."""

from __future__ import annotations

from typing import Any

import pytest
from study_copy import ROOT

from studies.section import left_out
from studies.sensitivity.settings import SensitivitySettings
from studies.statements.settings import StatementsSettings
from swesbi.base.settings import Settings
from swesbi.config.read import ConfigError, overlay, parse_section, read_yaml

SMALL = [
    ("sensitivity", SensitivitySettings, "variants", ["base", "fixed_physiology", "fixed_scale"]),
    (
        "statements",
        StatementsSettings,
        "readings",
        ["laboratory", "former_slope", "own_statistics", "own_beat", "correlation_and_peak"],
    ),
]


def own_section(name: str) -> dict[str, Any]:
    section: dict[str, Any] = read_yaml(ROOT / "studies" / name / "config.yaml")[name]
    return section


@pytest.mark.parametrize(("name", "model", "field", "kept"), SMALL, ids=[each[0] for each in SMALL])
def test_a_small_side_study_keeps_few_variants(
    name: str, model: type[Settings], field: str, kept: list[str]
) -> None:
    own = own_section(name)
    merged = overlay(own, read_yaml(ROOT / "studies" / name / "small.yaml")[name])
    parsed = parse_section(left_out(merged, own, model), name, model)
    assert list(getattr(parsed, field)) == kept
    assert {key: own[field][key] for key in kept} == {key: merged[field][key] for key in kept}


def test_null_within_the_changes_of_a_variant_stays() -> None:
    own = own_section("sensitivity")
    parsed = parse_section(left_out(own, own, SensitivitySettings), "x", SensitivitySettings)
    priors = parsed.variants["fixed_speed_scale"].to_plain()["changes"]["priors"]
    assert priors == {"calibrated": {"nuisances": {"speed_scale": None}}}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"variants": {"fixed_scal": None}}, r"variants\.fixed_scal = None"),
        ({"variants": None}, "variants = None"),
    ],
)
def test_null_for_anything_else_is_refused(changes: dict[str, Any], said: str) -> None:
    own = own_section("sensitivity")
    with pytest.raises(ConfigError, match=said):
        parse_section(left_out(overlay(own, changes), own, SensitivitySettings), "x", SensitivitySettings)


def test_a_section_that_is_missing_stays_missing() -> None:
    assert left_out(None, {}, SensitivitySettings) is None
