"""The page of a finished study: made by the workflow, with its own subjects, and it opens."""

from __future__ import annotations

import json
import re

import pytest
from browser import browser, find_browser, until
from study_copy import StudyCopy


@pytest.mark.slow(minutes=1)
def test_the_workflow_makes_the_page_of_its_subjects_and_it_answers(study_with_page: StudyCopy) -> None:
    results = study_with_page.results
    page = (results / "explorer.html").read_text(encoding="utf-8")
    data = re.search(r'<script type="application/json" id="study">(.*?)</script>', page, re.DOTALL)
    assert data is not None
    subjects = json.loads(data[1])["subjects"]
    folder = results / "calibrated" / "subjects"
    assert {subject["name"] for subject in subjects} == {path.name for path in folder.iterdir()}
    for subject in subjects:
        verdict = json.loads((folder / subject["name"] / "verdict.json").read_text())
        assert subject["verdict"] == verdict["sentence"]
    assert '<a href="explorer.html">' in (results / "index.html").read_text(encoding="utf-8")
    assert study_with_page.planned() == set()
    find_browser()
    with browser() as opened:
        opened.open(results / "explorer.html", 1400)
        until(opened, "document.body.dataset.answered", 60.0)
        assert opened.evaluate("document.getElementById('status').textContent").startswith("Periodic after")
        assert opened.complaints == []
