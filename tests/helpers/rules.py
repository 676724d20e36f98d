"""The stages that the rules of the study run, by rule, and one of them run by hand."""

from __future__ import annotations

import pkgutil
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from swesbi.config.read import read_merged
from swesbi.config.study import Study, load_study
from swesbi.config.view import View
from swesbi.study.job import run_stage
from swesbi.study.stage import plain_settings

ROOT: Final = Path(__file__).parents[2]
RULE: Final = re.compile(r"^ *rule (\w+):\n.*?\*\*stage\(\s*\"([\w.:]+)\"", re.MULTILINE | re.DOTALL)


def stages() -> dict[str, str]:
    """Return the stage of each rule of the study, ``package.module:function``."""
    texts = [path.read_text(encoding="utf-8") for path in sorted((ROOT / "workflow/rules").glob("*.smk"))]
    blocks = (block for text in texts for block in re.split(r"\n(?= *rule \w+:)", text))
    return dict(match.groups() for block in blocks if (match := RULE.search(block)))


STAGES: Final = stages()
PLACES: Final = {rule: (stage.split(":")[0], stage.split(":")[1]) for rule, stage in STAGES.items()}


def settings_of(rule: str, study: Study, **wildcards: str) -> dict[str, Any]:
    """Return the plain settings of a rule's stage under these wildcards."""
    return plain_settings(STAGES[rule], View.of_job(study, wildcards))


def run_rule(
    rule: str,
    study: Study,
    inputs: Mapping[str, Path | Sequence[Path]],
    outputs: Mapping[str, Path],
    **wildcards: str,
) -> None:
    """Run the stage of a rule as its job does."""
    stage = STAGES[rule]
    of_job = {"seed": study.config.seed, "subject": wildcards.get("subject", ""), "code": "0"}
    run_stage(
        pkgutil.resolve_name(stage),
        {name: [paths] if isinstance(paths, Path) else list(paths) for name, paths in inputs.items()},
        {name: [path] for name, path in outputs.items()},
        settings_of(rule, study, **wildcards) | of_job,
    )


def ingest_one(changes: Path, subject: str, observation: Path) -> None:
    """Ingest a recording of the cohort that an overlay of the configuration names, as the study does."""
    study = load_study(read_merged(ROOT / "config.yaml", changes))
    run_rule(
        "ingest",
        study,
        {"table": study.cohort.recording(subject)},
        {"observation": observation},
        subject=subject,
    )
