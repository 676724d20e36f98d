"""What makes an edit rerun the page: its hash follows this package, its scripts, and the study's."""

from __future__ import annotations

from pathlib import Path

import pytest
from study_copy import ROOT, copy_tree

import swesbi
from swesbi.study.code import Packages
from swesbi.study.stage import stage_code

STAGE = "explorer.stages:explorer"
STUDY = Path(swesbi.__file__).parent


@pytest.mark.parametrize("file", ["templates/page.js", "translation/runtime/numpy.js"])
def test_an_edit_of_a_script_makes_the_page_anew(tmp_path: Path, file: str) -> None:
    copy_tree(ROOT / "explorer", tmp_path / "explorer")
    assert Packages(STUDY, tmp_path / "explorer").hash(*STAGE.split(":")) == stage_code(STAGE)
    with (tmp_path / "explorer" / file).open("a", encoding="utf-8") as script:
        script.write("// edited\n")
    assert Packages(STUDY, tmp_path / "explorer").hash(*STAGE.split(":")) != stage_code(STAGE)


def test_what_is_translated_counts_whichever_package_it_is_of() -> None:
    followed = {module for module, _ in Packages(STUDY, ROOT / "explorer").followed(*STAGE.split(":"))}
    assert {"explorer.dropped", "explorer.translation.loops", "swesbi.heart.kernel"} <= followed
