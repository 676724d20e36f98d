"""The overview of a cohort that a population's network answers: table, figure of any size, strata."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cohort_case import REASON, TITLE, answer, context, strata, table
from figure_text import assert_text_apart, text_boxes
from study_copy import ROOT, StudyCopy

from swesbi.artefacts import ArtefactError
from swesbi.checks.calibration.table import STRATA
from swesbi.config.read import read_merged
from swesbi.config.study import load_study
from swesbi.config.view import View
from swesbi.parameters import PHI_NAMES
from swesbi.posterior.result import ExactPosterior
from swesbi.prior import JointPriorSettings
from swesbi.report.figures.cohort import OUTSIDE, Overview, counted_reasons, draw_cohort
from swesbi.report.figures.strata import draw_strata
from swesbi.verdict.summary import COHORT, REFUSED, answer_columns, cohort_table

SHIPPED = read_merged(ROOT / "config.yaml") | {"cohort": str(ROOT / "data" / "virtual_volunteers")}


def overview(subjects: int, refused: int, *, truth: bool) -> Overview:
    study = load_study(SHIPPED)
    plain = View(study, {"experiment": "amortised"})["joint_prior"]
    shown = table(subjects, refused)
    known: Mapping[str, np.ndarray] = {name: np.array([42.0, 5.0, 30.0]) for name in shown["subject"]}
    return Overview(shown, known if truth else {}, JointPriorSettings.from_plain(plain), 0.9)


def test_a_refused_subject_has_its_reason_and_no_answer() -> None:
    shown = table(3, 1)
    assert shown["status"].tolist() == ["not contradicted", "doubtful", REFUSED]
    assert shown["reason"].tolist() == ["", "χ²", REASON]
    assert shown.iloc[-1][list(answer_columns())].isna().all()
    assert shown.iloc[1]["k0_kpa_low"] == pytest.approx(0.8 * shown.iloc[1]["k0_kpa_median"])


def test_a_subject_that_is_neither_answered_nor_refused_is_missed() -> None:
    with pytest.raises(ArtefactError, match="S001: neither a posterior nor a reason"):
        cohort_table([context(0), context(1)], {"S000": answer(0)}, {})


def test_the_table_reads_back_with_empty_answers(tmp_path: Path) -> None:
    path = tmp_path / "cohort.csv"
    table(4, 2).to_csv(path, index=False)
    assert COHORT.read(path)["reason"].tolist() == ["", "χ²", REASON, REASON]
    path.write_text("subject,status\nA,not contradicted\n")
    with pytest.raises(ArtefactError, match="lacks the columns reason, duration_ms_median"):
        COHORT.read(path)


def test_reasons_are_counted_by_subject_the_commonest_first() -> None:
    assert counted_reasons(table(8, 2)) == {"χ²": 4, OUTSIDE: 2, "mass at a bound": 2}


@pytest.mark.parametrize(("subjects", "refused", "truth"), [(6, 1, False), (60, 3, True), (2, 2, False)])
def test_the_overview_is_readable_and_of_one_size_whatever_the_cohort(
    subjects: int, refused: int, truth: bool
) -> None:
    figure = draw_cohort(overview(subjects, refused, truth=truth), TITLE, "amortised")
    assert figure.get_size_inches().tolist() == [7.2, 7.0]
    assert_text_apart(figure)
    texts = [text for text, _ in text_boxes(figure)]
    assert any(TITLE in text for text in texts)
    assert f"refused ({refused})" in texts
    assert ("S000" in texts) == (subjects <= 24 and refused < subjects)


def test_a_truth_widens_the_axes_to_hold_it() -> None:
    far = overview(6, 0, truth=True)
    far = replace(far, truth={**far.truth, "S000": np.array([900.0, 5.0, 30.0])})
    limits = [axes.get_ylim() for axes in draw_cohort(far, TITLE, "amortised").axes]
    assert limits[0][1] > 900.0


def test_strata_are_drawn_with_their_numbers_and_no_text_on_another() -> None:
    figure = draw_strata(strata(), interval=0.9, experiment="amortised")
    assert_text_apart(figure)
    assert "female (400; 60 %)" in [text for text, _ in text_boxes(figure)]
    with pytest.raises(ValueError, match="no coverage of 80 % intervals"):
        draw_strata(strata(), interval=0.8, experiment="amortised")


def test_a_file_that_is_no_table_of_strata_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "strata.csv"
    strata().drop(columns="ci_low").to_csv(path, index=False)
    with pytest.raises(ArtefactError, match="lacks the columns ci_low"):
        STRATA.read(path)


def test_the_table_of_a_study_has_the_medians_and_limits_of_its_draws(finished: StudyCopy) -> None:
    folder = finished.results / "amortised"
    shown = COHORT.read(folder / "cohort.csv").set_index("subject")
    assert list(shown.index) == ["A", "F", "G"]
    for subject in shown.index:
        phi = ExactPosterior.read(folder / "subjects" / subject / "posterior.h5").phi
        for j, name in enumerate(PHI_NAMES):
            limits = shown.loc[subject, [f"{name}_{end}" for end in ("low", "median", "high")]]
            np.testing.assert_allclose(
                limits.to_numpy(dtype=float), np.quantile(phi[:, j], [0.05, 0.5, 0.95]), rtol=1e-6
            )
