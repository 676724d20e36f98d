"""The profile for a cluster names rules that exist, and asks for what the jobs take."""

from __future__ import annotations

import re
from typing import Any

import yaml
from study_copy import ROOT

LARGEST_MB = 4096


def profile() -> dict[str, Any]:
    text = (ROOT / "workflow" / "profiles" / "slurm" / "config.yaml").read_text(encoding="utf-8")
    return dict(yaml.safe_load(text))


def test_what_the_profile_says_of_rules_is_of_rules_that_exist() -> None:
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "workflow" / "rules").glob("*.smk")]
    rules = set(re.findall(r"^ *rule (\w+):", "\n".join(texts), re.MULTILINE))
    content = profile()
    assert len(rules) > 30
    assert set(content["set-resources"]) <= rules
    assert set(content["groups"]) <= rules
    assert set(content["group-components"]) <= set(content["groups"].values())


def test_no_job_asks_for_less_than_the_rest_or_for_a_whole_node() -> None:
    content = profile()
    default = content["default-resources"]["mem_mb"]
    assert all(default < asked["mem_mb"] <= LARGEST_MB for asked in content["set-resources"].values())
