"""The profile for a cluster names rules that exist, and asks for what the jobs take."""

from __future__ import annotations

import re

import yaml
from study_copy import ROOT

LARGEST_MB = 4096


def test_the_profile_names_rules_that_exist_and_asks_for_more_than_the_rest_but_no_whole_node() -> None:
    text = (ROOT / "workflow" / "profiles" / "slurm" / "config.yaml").read_text(encoding="utf-8")
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "workflow" / "rules").glob("*.smk")]
    rules = set(re.findall(r"^ *rule (\w+):", "\n".join(texts), re.MULTILINE))
    content = yaml.safe_load(text)
    assert {*content["set-resources"], *content["groups"]} <= rules
    assert set(content["group-components"]) <= set(content["groups"].values())
    default = content["default-resources"]["mem_mb"]
    assert all(default < asked["mem_mb"] <= LARGEST_MB for asked in content["set-resources"].values())
