"""What describes the project for others says the same everywhere: version, date, licence."""

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


def test_version_date_and_licence_are_those_of_the_package() -> None:
    newest = HEADING.search(CHANGELOG)
    assert newest is not None
    date = str(CITATION["date-released"])
    assert newest["version"] == __version__ == CITATION["version"] == CODEMETA["version"]
    assert newest["date"] == date == CODEMETA["datePublished"]
    assert CITATION["license"] == PROJECT["license"] == CODEMETA["license"].rpartition("/")[2]
