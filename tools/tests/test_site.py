"""The source of the site: pages in order, and what is made of the code."""

from __future__ import annotations

from pathlib import Path

import pytest
from study_copy import ROOT

import swesbi
from swesbi.__main__ import COMMANDS
from tools.settings import rows
from tools.site import PAGES, write_source


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What Sphinx reads; tests do not write there."""
    folder = tmp_path_factory.mktemp("site") / "source"
    write_source(folder)
    return folder


def test_the_first_page_lists_every_page_of_docs_in_order(source: Path) -> None:
    listed = (source / "README.md").read_text(encoding="utf-8").splitlines()
    there = {path.stem for path in (ROOT / "docs").glob("*.md")}
    pages = [line.removeprefix("docs/") for line in listed if line.removeprefix("docs/") in there]
    assert sorted(pages) == sorted(there)
    assert pages[: len(there & set(PAGES))] == [page for page in PAGES if page in there]


def test_commands_settings_and_interface_are_those_of_the_code(source: Path) -> None:
    text = {path.stem: path.read_text(encoding="utf-8") for path in (source / "reference").iterdir()}
    assert all(f"## swesbi {name}\n\n```text\nusage: " in text["commands"] for name in COMMANDS)
    assert all(f"`{row.key}`" in text["settings"] for row in rows())
    assert all(f":: swesbi.{name}\n" in text["interface"] for name in swesbi.__all__)
