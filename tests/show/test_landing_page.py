"""The landing page: short with eight subjects, the answer first, its limits, answers to new subjects."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from comparison_case import observation
from jinja2 import ChainableUndefined
from report_case import make_experiment

from swesbi.artefacts import ArtefactError
from swesbi.show.page.forest import LEFT, Interval, panel
from swesbi.show.page.landing import make_landing
from swesbi.show.page.new import new_subjects
from swesbi.show.page.page import Cohort, templates
from swesbi.show.results import Results
from swesbi.show.table import Table
from swesbi.verdict.support import Support

SUBJECTS = "ABCDEFGH"
MOST_WORDS = 900
NAN = float("nan")
COHORT = Cohort("virtual volunteers", "data", "virtual volunteers, simulated by a test", ())


def made(new: Table | None = None, *links: str) -> str:
    experiment = make_experiment("paper", {name: name != "F" for name in SUBJECTS})
    observations = tuple(map(observation, SUBJECTS))
    results = Results(observations, (experiment,), experiment, pd.DataFrame())
    landing = make_landing(results, (), "virtual volunteers", ("paper/subjects/A/ppc.png", *links), new)
    page = {"landing": landing, "cohort": COHORT}
    environment = templates().overlay(undefined=ChainableUndefined)
    return environment.get_template("report.html").render(page=page, here="report", root="")


def shown_words(html: str) -> list[str]:
    """Return what a reader sees before anything is unfolded."""
    body = html[html.index("<body>") :]
    for hidden in (r"<script>.*?</script>", r"(?<=</summary>).*?(?=</details>)", r"<[^>]*>"):
        body = re.sub(hidden, " ", body, flags=re.DOTALL)
    return body.split()


def test_eight_subjects_leave_room_for_the_validation() -> None:
    words = shown_words(made())
    assert 200 < len(words) < MOST_WORDS - 300  # the validation's sentences are about 220 words


def test_the_explorer_is_linked_where_there_is_one() -> None:
    assert "explorer.html" not in made()
    assert made(None, "explorer.html").count('<a href="explorer.html">Explorer</a>') == 1


def test_the_origin_does_not_repeat_the_title() -> None:
    assert "<strong>virtual volunteers</strong>: simulated by a test." in made()
    assert replace(COHORT, origin="volunteers of 2024").origin_after_title == "volunteers of 2024"
    assert replace(COHORT, origin=COHORT.title).origin_after_title == COHORT.title


def test_the_verdicts_come_first_and_a_subject_that_is_not_to_be_read_says_so() -> None:
    html = made()
    assert html.index("7 supported (A, B, C, D, E, G, H), 1 unsupported (F)") < html.index("<table>")
    assert "outside the prior" in html and "ejection fraction predicted above measured" in html
    assert html.count("<article") == len(SUBJECTS) and html.count("paper/subjects/A/ppc.png") == 2
    assert "Too narrow" in html


def test_a_panel_starts_at_zero_and_leaves_out_who_is_not_answered() -> None:
    drawn = panel(
        "k_0", "kPa", [Interval("A", "supported", 5, 4, 6), Interval("F", "unsupported", NAN, NAN, NAN)]
    )
    (mark,) = drawn.marks
    assert LEFT < mark.low < mark.median < mark.high <= drawn.right
    assert mark.median - mark.low == pytest.approx(mark.high - mark.median, abs=0.2)
    assert drawn.ticks[0] == (LEFT, "0")
    assert drawn.description == "k_0 in kPa: A 5.00 (4.00 to 6.00)"


def test_answers_to_new_subjects_are_listed_where_there_are_any(tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    assert new_subjects(page) is None
    folder = tmp_path / "amortised" / "new" / "clinic" / "P1"
    folder.mkdir(parents=True)
    answer = {"k0_kpa": {"median": 40.0, "low": 16.4, "high": 69.6}}
    said = Support(1.0, "c", 9, 9, {}, True, "strained: c", (), status="strained", answer=answer)
    (folder / "support.json").write_text(json.dumps(said.to_json()))
    (tmp_path / "new" / "clinic").mkdir(parents=True)
    (tmp_path / "new" / "clinic" / "answers.csv").write_text("subject\n")
    table = new_subjects(page)
    assert table is not None
    assert table.rows[0].strained and table.rows[0].cells[:5] == (
        "P1", "clinic", "amortised", "strained", "40.0 (16.4 to 69.6)",
    )  # fmt: skip
    (folder / "support.json").write_text('{"status": "strained"}')
    with pytest.raises(ArtefactError, match="P1/support.json: cannot be read as support diagnostics"):
        new_subjects(page)
    html = made(table)
    assert 'href="new/clinic/answers.csv"' in html and 'href="amortised/new/clinic/P1/support.json"' in html
