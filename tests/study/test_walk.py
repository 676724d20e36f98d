"""The walk in ``src/swesbi/README.md``: one recording to its answer is what the stages do, in that order."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import pytest
from rules import run_rule
from study_copy import ROOT, StudyCopy

from swesbi.config.read import read_merged
from swesbi.config.study import load_study
from swesbi.config.view import nulls_of

ROW = re.compile(r"^\| .* \| `(?P<file>[a-z_/]+)\.py` \| `(?P<function>[\w.]+)` \|$", re.MULTILINE)
PAGE = ROOT / "src" / "swesbi" / "README.md"


@contextmanager
def first_calls(seen: dict[tuple[str, str], None]) -> Iterator[None]:
    """Note functions in the order in which they are first called."""

    def note(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            seen.setdefault((frame.f_globals.get("__name__", ""), frame.f_code.co_qualname))

    sys.setprofile(note)
    try:
        yield
    finally:
        sys.setprofile(None)


@pytest.mark.slow(minutes=0.3)
def test_one_recording_is_answered_in_the_order_of_the_page(finished: StudyCopy, tmp_path: Path) -> None:
    cohort, made = finished.folder / "data" / "virtual_volunteers", finished.results / "calibrated"
    merged = read_merged(finished.folder / "config.yaml", finished.folder / finished.config)
    study = load_study(merged | {"cohort": str(cohort)})
    subjects = study.subjects_of("calibrated")
    new = {name: tmp_path / f"{name}.h5" for name in ("observation", "noise", "contexts", "posterior")}
    inputs: dict[str, dict[str, Path | list[Path]]] = {
        "ingest": {"table": cohort / "swe" / "A.csv"},
        "noise": {
            "tables": [cohort / "swe" / f"{name}.csv" for name in subjects],
            "observations": [finished.results / "cohort" / name / "observation.h5" for name in subjects],
            "protocol": cohort / "recording.yaml",
        },
        "exact_posterior": {
            "observation": new["observation"], "noise": new["noise"], "estimator": made / "flow.h5",
        },
        "verdict": {**new, "null": nulls_of(study, "calibrated")},
    }  # fmt: skip
    outputs = {
        "ingest": {"observation": new["observation"]},
        "noise": {"noise": new["noise"], "contexts": new["contexts"]},
        "exact_posterior": {"posterior": new["posterior"]},
        "verdict": {"verdict": tmp_path / "verdict.json"},
    }
    seen: dict[tuple[str, str], None] = {}
    for rule, files in inputs.items():
        with first_calls(seen):
            run_rule(rule, study, files, outputs[rule], subject="A", experiment="calibrated")
    rows = ROW.finditer(PAGE.read_text(encoding="utf-8"))
    told = [(f"swesbi.{row['file'].replace('/', '.')}", row["function"]) for row in rows]
    assert len(told) > 20
    assert [step for step in seen if step in told] == told
