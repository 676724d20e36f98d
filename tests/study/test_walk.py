"""The walk in ``src/swesbi/README.md``: one recording to its answer is what the stages do, in that order."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import get_type_hints

import pytest
from study_copy import ROOT, StudyCopy

from swesbi.artefacts import Origin
from swesbi.config.read import read_merged
from swesbi.config.slices import stage_settings
from swesbi.config.study import load_study
from swesbi.study.nulls import nulls_of
from swesbi.study.registry import stage_function

ROW = re.compile(r"^\| .* \| `(?P<file>[a-z_/]+)\.py` \| `(?P<function>[a-z_]+)` \|$", re.MULTILINE)
PAGE = ROOT / "src" / "swesbi" / "README.md"


def steps() -> list[tuple[str, str]]:
    """Return module and function of each step that the page names."""
    rows = ROW.finditer(PAGE.read_text(encoding="utf-8"))
    return [(f"swesbi.{row['file'].replace('/', '.')}", row["function"]) for row in rows]


@contextmanager
def first_calls(seen: dict[tuple[str, str], None]) -> Iterator[None]:
    """Note functions in the order in which they are first called."""

    def note(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            seen.setdefault((frame.f_globals.get("__name__", ""), frame.f_code.co_name))

    sys.setprofile(note)
    try:
        yield
    finally:
        sys.setprofile(None)


@pytest.mark.slow(minutes=0.3)
def test_one_recording_is_answered_in_the_order_of_the_page(finished: StudyCopy, tmp_path: Path) -> None:
    study = load_study(
        read_merged(finished.folder / "config.yaml", finished.folder / finished.config)
        | {"cohort": str(finished.folder / "data" / "virtual_volunteers")}
    )
    cohort, made = finished.folder / "data" / "virtual_volunteers", finished.results / "calibrated"
    subjects = study.subjects_of("calibrated")
    new = {name: tmp_path / f"{name}.h5" for name in ("observation", "noise", "contexts", "posterior")}
    stages = {
        "ingest": {"recording": cohort / "swe" / "A.csv", "observation": new["observation"]},
        "noise": {
            "recordings": [cohort / "swe" / f"{name}.csv" for name in subjects],
            "observations": [finished.results / "cohort" / name / "observation.h5" for name in subjects],
            "protocol": cohort / "recording.yaml", "noise": new["noise"], "contexts": new["contexts"],
        },
        "exact_posterior": {
            "observation": new["observation"], "noise": new["noise"], "posterior": new["posterior"],
            "estimator": made / "flow.h5",
        },
        "verdict": {
            **new, "null": nulls_of(study, "calibrated"),
            "verdict": tmp_path / "verdict.json",
        },
    }  # fmt: skip
    seen: dict[tuple[str, str], None] = {}
    for name, files in stages.items():
        run = stage_function(name)
        plain = stage_settings(study, name, subject="A", experiment="calibrated")
        settings = get_type_hints(run)["settings"].from_plain(plain)
        with first_calls(seen):
            run(**files, settings=settings, origin=Origin(study.config.seed, "A", "0"))
    called, told = list(seen), steps()
    assert len(told) > 20
    assert [step for step in called if step in told] == told
