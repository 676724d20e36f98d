"""The source of the site: pages in order, and what is made of the code."""

from __future__ import annotations

from pathlib import Path

from study_copy import ROOT

import swesbi
from swesbi.__main__ import COMMANDS
from tools.settings import rows
from tools.site import PAGES, write_source


def test_the_source_lists_every_page_in_order_and_what_the_code_has(tmp_path: Path) -> None:
    source = tmp_path / "source"
    write_source(source)
    listed = (source / "README.md").read_text(encoding="utf-8").splitlines()
    there = {path.stem for path in (ROOT / "docs").glob("*.md")}
    pages = [line.removeprefix("docs/") for line in listed if line.removeprefix("docs/") in there]
    assert sorted(pages) == sorted(there)
    assert pages[: len(there & set(PAGES))] == [page for page in PAGES if page in there]
    text = {path.stem: path.read_text(encoding="utf-8") for path in (source / "reference").iterdir()}
    assert all(f"## swesbi {name}\n\n```text\nusage: " in text["commands"] for name in COMMANDS)
    assert all(f"`{row.key}`" in text["settings"] for row in rows())
    assert all(f":: swesbi.{name}\n" in text["interface"] for name in swesbi.__all__)
