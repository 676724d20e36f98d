"""The landing page: the answer first, and its limits."""

from __future__ import annotations

import pandas as pd
import pytest
from comparison_case import observation
from jinja2 import ChainableUndefined
from report_case import make_experiment

from swesbi.report.page.forest import LEFT, panel
from swesbi.report.page.landing import level_kept, make_landing
from swesbi.report.page.page import Cohort, templates
from swesbi.report.results import Results

SUBJECTS = "ABCDEFGH"
NAN = float("nan")
COHORT = Cohort("virtual volunteers", "data", "virtual volunteers, simulated by a test", ())


def made(*links: str) -> str:
    experiment = make_experiment("paper", {name: name != "F" for name in SUBJECTS})
    observations = tuple(map(observation, SUBJECTS))
    statements = pd.DataFrame({"agrees": ["yes", "no", "yes"], "origin": ["found", "found", "designed"]})
    results = Results(observations, (experiment,), experiment, pd.DataFrame(), statements)
    landing = make_landing(results, "virtual volunteers", ("paper/subjects/A/ppc.png", *links))
    page = {"landing": landing, "cohort": COHORT}
    environment = templates().overlay(undefined=ChainableUndefined)
    return environment.get_template("index.html").render(page=page, here="index", root="")


def test_the_verdicts_come_first_and_a_subject_that_is_not_to_be_read_says_so() -> None:
    html = made()
    assert html.index("7 prior-supported (A, B, C, D, E, G, H), 1 not prior-supported (F)") < html.index(
        "<table>"
    )
    assert "outside the prior" in html and "ejection fraction predicted above measured" in html
    assert html.count("<article") == len(SUBJECTS) and html.count("paper/subjects/A/ppc.png") == 2
    assert "Too narrow" in html
    assert "2 of the paper&#39;s 3 statements agree, 1 of them by design" in html


def test_a_level_is_kept_only_where_the_recordings_could_show_that_it_is_not() -> None:
    def said(n: int, low: float, high: float) -> str:
        row = {"nominal": [0.9], "n": [n], "ci_low": [low], "ci_high": [high]}
        return level_kept(pd.DataFrame(row, ["k0_kpa"]))

    assert said(320, 0.87, 0.94) == "They keep their level where the model is right."
    assert said(320, 0.70, 0.80) == "Too narrow: k_0."
    assert said(18, 0.65, 0.98) == "18 recordings do not exclude that they contain it in 65 % only."


def test_a_panel_starts_at_zero_and_leaves_out_who_is_not_answered() -> None:
    rows = [("A", "not contradicted", 5.0, 4.0, 6.0), ("F", "contradicted", NAN, NAN, NAN)]
    drawn = panel("k_0", "kPa", pd.DataFrame(rows, columns=["subject", "status", "median", "low", "high"]))
    (mark,) = drawn.marks
    assert LEFT < mark["low"] < mark["median"] < mark["high"] <= drawn.right
    assert mark["median"] - mark["low"] == pytest.approx(mark["high"] - mark["median"], abs=0.2)
    assert drawn.ticks[0] == (LEFT, "0")
    assert drawn.description == "k_0 in kPa: A 5.00 (4.00 to 6.00)"
