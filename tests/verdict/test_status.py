from __future__ import annotations

import re
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import hierarchy_case
import pandas as pd
import pytest
from cohort_case import REASON, TITLE, answer, context, strata
from figure_text import text_boxes
from speed_case import settings

from swesbi.artefacts import ArtefactError, Provenance, write_json
from swesbi.report.figures.cohort import Overview, draw_cohort
from swesbi.report.figures.style import STATUS_COLORS
from swesbi.report.page.landing import MEANING
from swesbi.report.tables.population import PopulationSection, counts_table
from swesbi.verdict.summary import REFUSED, cohort_table
from swesbi.verdict.verdict import PAPER_STATUSES, STATUSES, Status, Verdict

OUTCOMES = [*STATUSES, REFUSED]


@pytest.fixture
def cohort() -> pd.DataFrame:
    """A subject of each status, and a refused one."""
    contexts = [context(number) for number in range(len(OUTCOMES))]
    answers = {
        one.subject: replace(answer(0), status=status)
        for one, status in zip(contexts, STATUSES, strict=False)
    }
    return cohort_table(contexts, answers, {contexts[-1].subject: REASON})


@pytest.mark.parametrize("status", Status)
def test_a_verdict_is_read_as_it_was_written_and_another_word_is_refused(
    status: Status, tmp_path: Path
) -> None:
    verdict, path = Verdict(1.0, "", 1, 1, {}, status, f"{status}: so", ()), tmp_path / "verdict.json"
    verdict.write(path, Provenance(""))
    assert f'"status": "{status.value}"' in path.read_text(encoding="utf-8")
    read = Verdict.read(path)
    assert read == verdict and read.status is status
    write_json(path, verdict.to_json() | {"status": f"{status}!"})
    with pytest.raises(ArtefactError, match="is not a valid Status"):
        Verdict.read(path)


def test_a_population_takes_every_status_and_the_worse_is_the_likelier_outlier() -> None:
    outliers = [hierarchy_case.OUTLIERS.of(status) for status in STATUSES]
    assert outliers == sorted(outliers)
    assert outliers[0] == outliers[STATUSES.index(Status.UNINFORMATIVE)] < outliers[-1]
    with pytest.raises(ValueError, match="'prior-supported': expected one of not contradicted, uninf"):
        hierarchy_case.OUTLIERS.of(PAPER_STATUSES[0])


def test_figures_and_tables_of_a_cohort_count_every_status(cohort: pd.DataFrame) -> None:
    overview = Overview(cohort, {}, settings().prior, 0.9)
    texts = [text for text, _ in text_boxes(draw_cohort(overview, TITLE, "amortised"))]
    assert [word for word in OUTCOMES if f"{word} (1)" not in texts] == []
    shown = PopulationSection("amortised", {}, 0.9, cohort, strata())
    assert [row.cells[0] for row in counts_table(shown, TITLE).rows] == OUTCOMES


def test_every_status_has_its_colours_and_its_meaning() -> None:
    assert set(STATUS_COLORS) == set(STATUSES)
    assert set(MEANING) == set(Status)
    css = files("swesbi.report.page").joinpath("templates/page.css").read_text(encoding="utf-8")
    marked = {name for rule in re.findall(r"^(.*) \{ --mark", css, re.MULTILINE) for name in rule.split(", ")}
    assert {f".{status.replace(' ', '-')}" for status in Status} <= marked
