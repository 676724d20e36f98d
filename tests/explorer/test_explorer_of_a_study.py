"""The page of a finished study: made by the workflow, with its own subjects, and it opens."""

from __future__ import annotations

import json
import re
import time

from browser import browser, find_browser
from study_copy import StudyCopy


def test_the_workflow_makes_the_page_of_its_subjects(finished: StudyCopy) -> None:
    page = (finished.results / "explorer.html").read_text(encoding="utf-8")
    data = re.search(r'<script type="application/json" id="study">(.*?)</script>', page, re.DOTALL)
    assert data is not None
    subjects = json.loads(data[1])["subjects"]
    folder = finished.results / "calibrated" / "subjects"
    assert {subject["name"] for subject in subjects} == {path.name for path in folder.iterdir()}
    for subject in subjects:
        support = json.loads((folder / subject["name"] / "support.json").read_text())
        assert subject["verdict"] == support["verdict"]


def test_the_page_of_a_study_opens_and_answers(finished: StudyCopy) -> None:
    find_browser()
    with browser() as page:
        page.open(finished.results / "explorer.html", 1400)
        limit = time.monotonic() + 60.0
        while not page.evaluate("Boolean(document.body.dataset.answered)"):
            assert time.monotonic() < limit
            time.sleep(0.1)
        assert page.evaluate("document.getElementById('status').textContent").startswith("Periodic after")
        assert page.complaints == []
