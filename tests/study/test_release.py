"""What describes the project for others says the same everywhere: version, date, authors, licence, words."""

from __future__ import annotations

import json
import re
import tomllib
from typing import Any

import yaml
from study_copy import ROOT

from swesbi import __version__

CITATION: dict[str, Any] = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
CODEMETA: dict[str, Any] = json.loads((ROOT / "codemeta.json").read_text(encoding="utf-8"))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CHANGELOG = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
HEADING = re.compile(r"^## (?P<version>\d+\.\d+\.\d+) \((?P<date>\d{4}-\d{2}-\d{2})\)$", re.MULTILINE)
DEVELOPERS = "The swesbi developers"


def test_the_newest_version_of_the_changelog_is_the_package_s() -> None:
    newest = HEADING.search(CHANGELOG)
    assert newest is not None
    date = str(CITATION["date-released"])
    assert newest["version"] == __version__ == CITATION["version"] == CODEMETA["version"]
    assert newest["date"] == date == CODEMETA["datePublished"]


def test_versions_of_the_changelog_fall_and_nothing_stands_before_unreleased() -> None:
    headings = re.findall(r"^## (.*)$", CHANGELOG, re.MULTILINE)
    assert headings[0] == "Unreleased" and len(set(headings)) == len(headings)
    dated = [match.groupdict() for match in HEADING.finditer(CHANGELOG)]
    assert len(dated) == len(headings) - 1
    numbers = [tuple(map(int, each["version"].split("."))) for each in dated]
    assert numbers == sorted(numbers, reverse=True)
    assert [each["date"] for each in dated] == sorted((each["date"] for each in dated), reverse=True)


def test_authors_and_licence_are_the_same() -> None:
    assert [each["name"] for each in CITATION["authors"]] == [DEVELOPERS]
    assert [each["name"] for each in CODEMETA["author"]] == [DEVELOPERS]
    assert CITATION["license"] == PROJECT["license"] == CODEMETA["license"].rpartition("/")[2]
    assert DEVELOPERS.lower() in (ROOT / "LICENSE").read_text(encoding="utf-8").lower()
    assert "CC-BY-4.0" in (ROOT / "data" / "LICENSE").read_text(encoding="utf-8")


def test_nothing_has_an_identifier_or_an_address_that_does_not_exist() -> None:
    for described in (CITATION, CODEMETA):
        assert not {"doi", "identifier", "identifiers", "repository-code", "url", "codeRepository"} & set(
            described
        )
