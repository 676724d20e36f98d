"""The profiles for clusters name rules that exist, and ask for what the jobs take."""

from __future__ import annotations

import re
from typing import Any

import pytest
import yaml
from study_copy import ROOT

NAMES = ("slurm", "kubernetes")
LARGEST_MB = 4096


def profile(name: str) -> dict[str, Any]:
    text = (ROOT / "workflow" / "profiles" / name / "config.yaml").read_text(encoding="utf-8")
    return dict(yaml.safe_load(text))


def memory(name: str) -> dict[str, int]:
    return {rule: asked["mem_mb"] for rule, asked in profile(name)["set-resources"].items()}


@pytest.mark.parametrize("name", NAMES)
def test_what_a_profile_says_of_rules_is_of_rules_that_exist(name: str) -> None:
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "workflow" / "rules").glob("*.smk")]
    rules = set(re.findall(r"^ *rule (\w+):", "\n".join(texts), re.MULTILINE))
    content = profile(name)
    assert len(rules) > 30
    assert set(content["set-resources"]) <= rules
    assert set(content["groups"]) <= rules
    assert set(content["group-components"]) <= set(content["groups"].values())


def test_both_ask_for_the_same_memory_and_group_alike() -> None:
    one, two = map(profile, NAMES)
    assert memory("slurm") == memory("kubernetes")
    assert one["default-resources"]["mem_mb"] == two["default-resources"]["mem_mb"]
    for key in ("groups", "group-components", "cores"):
        assert one[key] == two[key], key


def test_no_job_asks_for_less_than_the_rest_or_for_a_whole_node() -> None:
    default = profile("slurm")["default-resources"]["mem_mb"]
    assert all(default < asked <= LARGEST_MB for asked in memory("slurm").values())
