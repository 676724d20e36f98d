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


def test_description_and_keywords_are_the_same() -> None:
    assert CODEMETA["description"] == PROJECT["description"]
    assert CODEMETA["keywords"] == CITATION["keywords"]
    paper, cited = CODEMETA["referencePublication"], CITATION["preferred-citation"]
    assert paper["name"] == cited["title"]
    assert [each["familyName"] for each in paper["author"]] == [
        each["family-names"] for each in cited["authors"]
    ]


def test_nothing_has_an_identifier_or_an_address_that_does_not_exist() -> None:
    for described in (CITATION, CODEMETA):
        assert not {"doi", "identifier", "identifiers", "repository-code", "url", "codeRepository"} & set(
            described
        )


def test_the_catalogue_of_workflows_can_read_what_it_is_told() -> None:
    told = yaml.safe_load((ROOT / ".snakemake-workflow-catalog.yml").read_text(encoding="utf-8"))
    assert set(told) == {"usage"}
    assert set(told["usage"]) == {"mandatory-flags", "software-stack-deployment", "report"}
    assert set(told["usage"]["mandatory-flags"]) == {"desc", "flags"}
    rules = [path.read_text(encoding="utf-8") for path in (ROOT / "workflow" / "rules").glob("*.smk")]
    uses_conda = any(re.search(r"^\s+conda:", rule, re.MULTILINE) for rule in rules)
    assert told["usage"]["software-stack-deployment"]["conda"] is uses_conda
    assert told["usage"]["report"] is True and 'report: "workflow/report/study.rst"' in (
        ROOT / "Snakefile"
    ).read_text(encoding="utf-8")
