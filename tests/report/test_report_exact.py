from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from evaluation_cases import TITLE
from exact_shown import STATUS, result, verdict
from matplotlib.figure import Figure as Drawing
from report_case import make_experiment

from swesbi.artefacts import ArtefactError
from swesbi.artefacts.typed import Place
from swesbi.checks.calibration.table import ALARM_COLUMNS, ALARMS
from swesbi.checks.calibration.table import COLUMNS as CALIBRATION_COLUMNS
from swesbi.checks.truths import Truths
from swesbi.parameters import PHI_NAMES, THETA_NAMES
from swesbi.posterior.truncated import Posterior
from swesbi.recording.noise.cohort import CohortNoise, GroupNoise, NoiseEstimate
from swesbi.recording.noise.components import ComponentEstimate
from swesbi.report.figures.style import save_figure
from swesbi.report.page.landing import limits
from swesbi.report.page.sections import make_section, section_figures
from swesbi.report.results import Experiment, no_rows
from swesbi.report.study_tables import TRUTH_COLUMNS, beside_the_truth
from swesbi.report.table import Strong
from swesbi.report.tables.exact import exact_table, outcomes_table, verdicts_table
from swesbi.report.tables.experiments import (
    comparison_table,
    differences_table,
    recovery_table,
    training_table,
)
from swesbi.report.tables.subjects import posterior_table, score_table

SUBJECTS = "ADF"
SETTINGS = {
    "exact": {"interval": 0.9},
    "predictive": {"interval": 0.9},
    "observation_model": {"discrepancy": {"speed_fraction": 0.02, "timing_cycle": 0.015}},
}


def calibration() -> pd.DataFrame:
    rows = [
        [subject, made, sampler, "sbc", name, 12, 0.1, 0.002 if name == "k_sr_per_s" else 0.5, 0.008,
         int(name == "k_sr_per_s"), 0.875, 0.9]
        for subject, made in (("pooled", "model_noise"), ("A", "model_noise"), ("A", "local"))
        for sampler in ("proposal", "weighted")
        for name in THETA_NAMES
    ]  # fmt: skip
    rows.append(["pooled", "model_noise", "weighted", "tarp", "joint", 12, 0.1, 0.4, 0.05, 0, 0.905, np.nan])
    rows.append(["A", "local", "weighted, mcmc", "c2st", "joint", 50, 0.51, np.nan, 0.53, 0, np.nan, np.nan])
    return pd.DataFrame(rows, columns=list(CALIBRATION_COLUMNS))


def identifiability() -> pd.DataFrame:
    told = {
        "sd_log": 0.123, "contraction_log": 0.812, "expected_sd_log": 0.13, "sensitivity_prior": 0.06,
        "sensitivity_likelihood": 0.02, "sensitivity_nuisances": 0.04, "width_4": 0.94,
        "correlated_with": "speed_scale", "correlation": -0.951,
    }  # fmt: skip
    rows = [{"subject": subject, "quantity": name} | told for subject in SUBJECTS for name in PHI_NAMES]
    table = pd.DataFrame(rows)
    table.loc[table["quantity"] == "k_atp_per_s", "sensitivity_likelihood"] = 0.07
    return table


def truth() -> pd.DataFrame:
    answers = {"A": (5.0, 4.0, 6.0, True), "D": (5.0, 4.0, 6.0, False), "F": (np.nan, np.nan, np.nan, None)}
    rows = [
        ("calibrated", subject, STATUS.get(subject, "not contradicted"), name, 5.5, *answers[subject])
        for subject in SUBJECTS
        for name in THETA_NAMES
    ]
    return pd.DataFrame(rows, columns=list(TRUTH_COLUMNS)).astype({"inside": object})


def noise() -> CohortNoise:
    parts = [ComponentEstimate(size, 0.001, 0.9 * size, 1.1 * size) for size in (0.0443, 0.0794)]
    estimate = NoiseEstimate(*parts, repeats=330, samples=3700)
    return CohortNoise({"others": GroupNoise(estimate, dict.fromkeys(SUBJECTS, estimate), 0.62)}, 0.9)


@pytest.fixture
def exact() -> Experiment:
    rates = [("model_noise", alarm, 0.055, 0.0275, 0.11, 200) for alarm in ALARMS]
    return replace(
        make_experiment("calibrated", {name: STATUS.get(name) != "contradicted" for name in SUBJECTS}),
        settings=SETTINGS,
        verdicts={name: verdict(name) for name in SUBJECTS},
        results={name: result(name, 200) for name in SUBJECTS},
        calibration=calibration(),
        alarms=pd.DataFrame(rates, columns=list(ALARM_COLUMNS)),
        identifiability=identifiability(),
        noise=noise(),
        truth=truth(),
    )


def test_the_truth_table_counts_what_lies_inside_and_leaves_out_the_contradicted(tmp_path: Path) -> None:
    interval, nothing = np.array([[5.0, 60.0], [7.0, 60.0], [5.0, 20.0]]), np.empty((0, 3))
    median = interval.mean(axis=1)
    found = Posterior(nothing, nothing, np.empty(0, bool), median, interval, 0.9, np.eye(3), (), np.empty(0))
    verdicts = {Place("calibrated", name): verdict(name) for name in "AFB"}
    source = tmp_path / "truth.csv"
    source.write_text("subject,k0_kpa,k_atp_per_s,k_sr_per_s\nA,58,6,28\nF,60,80,30\n")
    table = beside_the_truth(dict.fromkeys(verdicts, found), verdicts, Truths.read(source))
    assert tuple(table.columns) == TRUTH_COLUMNS
    assert table["subject"].tolist() == ["A"] * 3 + ["F"] * 3
    assert table["inside"].tolist() == [True, False, False, None, None, None]
    assert table["low"].isna().tolist() == [False] * 3 + [True] * 3
    source.write_text("subject,k0_kpa\nA,58\n")
    with pytest.raises(ArtefactError, match="lacks the columns k_atp_per_s, k_sr_per_s"):
        Truths.read(source)


def test_verdicts_stand_with_the_reliability_of_their_draws(exact: Experiment) -> None:
    rows = verdicts_table(exact, TITLE).rows
    assert [row.mark for row in rows] == ["", "doubtful", "muted"]
    assert rows[1].cells[:4] == ("D", "doubtful", "residuals (p = 0.0002)", "importance weights")
    assert rows[0].cells[4:] == ("0.31", "82", "–", "yes")
    against = "residuals (p = 0.0002), mass at a bound (p = 0.0002)"
    assert rows[2].cells[1:7] == ("contradicted", against, "MCMC", "inf", "2", "1.004")


def test_flagged_tests_are_bold_and_tests_without_a_p_value_show_their_statistic(exact: Experiment) -> None:
    rows = {str(row.cells[0]): row.cells[1:] for row in outcomes_table(exact, TITLE).rows}
    assert rows["residuals"] == ("0.40", Strong("0.00020"), Strong("0.00020"))
    assert rows["end systolic volume"] == ("1.2", "1.2", "1.2")


def test_the_section_counts_what_failed_and_what_lies_inside(exact: Experiment) -> None:
    section = make_section(exact, {}, TITLE)
    assert section.facts["Verdicts"] == "1 not contradicted (A), 1 doubtful (D), 1 contradicted (F)"
    assert section.facts["Exact posteriors"].endswith("by MCMC: F")
    assert section.facts["Truth of the simulated recordings"] == "inside 3 of 6 intervals"
    rows = {name: [row.cells for row in table.rows] for name, table in section.tables.items()}
    shown = {cells[:2]: cells[2:] for cells in rows["calibration"]}
    own = shown["the model's own noise", "exact weights"]
    assert own == ("1 of 4", "1 of 3", "87.5", "87.5", "87.5", "90.5", "12")
    assert shown["at the subject's own data", "network alone"][0] == "–"
    assert [cells[4] for cells in rows["checks"]] == ["k_SR"] * 6
    assert [cells[1] for cells in rows["alarms"]] == ["5.5 (2.8 to 11.0)"]
    assert rows["identifiability"][0][2:] == (
        "0.812", "0.06", "0.04", "0.02", "12.3", "13.0", "94", "scale of all speeds (−0.95)"
    )  # fmt: skip
    assert rows["noise"][0] == ("between repeats", "4.43", "0.10", "3.99 to 4.87")


def test_a_parameter_that_prior_and_likelihood_move_is_said_to_be_disputed(exact: Experiment) -> None:
    said = list(limits(exact, "A"))
    assert [text for text in said if "disagree" in text] == ["prior and recording disagree on k_ATP"]
    assert not any("disagree" in text for text in limits(replace(exact, settings={"posterior": {}}), "A"))


def test_truth_of_the_contradicted_is_shown_without_an_answer(exact: Experiment) -> None:
    rows = exact_table(exact, TITLE).rows
    assert [row.mark for row in rows] == [""] * 4 + ["doubtful"] * 4 + ["muted"] * 4
    assert [str(row.cells[6]) for row in rows] == [*["yes"] * 3, "–", *["no"] * 3, "–", *["–"] * 4]
    assert [row.cells[5] for row in rows[-4:]] == ["5.50"] * 3 + ["–"]
    recorded = replace(exact, truth=no_rows())
    assert "Truth" not in [column.head for column in exact_table(recorded, TITLE).columns]
    assert "Truth of the simulated recordings" not in make_section(recorded, {}, TITLE).facts


def test_tables_of_all_experiments_take_both_kinds(exact: Experiment) -> None:
    paper = make_experiment("paper", dict.fromkeys(SUBJECTS, True))
    (row,) = differences_table([exact], paper).rows
    assert row.cells == ("calibrated", "kind", "noise on features", "noise on the measured speeds")
    both = [paper, exact]
    assert comparison_table(both, TITLE).rows[0].cells[2] == "2 of 3 (A, D)"
    assert posterior_table(both, TITLE).rows[-1].cells[3:6] == ("calibrated", "–", "–")
    assert len(recovery_table(both).rows) == 12 and len(training_table(both).rows) == 2


def test_figures_are_found_by_kind_and_experiment(tmp_path: Path) -> None:
    pngs = [tmp_path / f"{name}.png" for name in ("ppc-calibrated", "ppc-other", "noise")]
    for png in pngs:
        save_figure(Drawing(figsize=(2.0, 1.0)), png)
    found = section_figures("speeds", pngs, "calibrated", tmp_path / "index.html", TITLE)
    assert sorted(found) == ["noise", "ppc"]
    assert (found["ppc"].source, found["ppc"].full) == ("ppc-calibrated.png", "ppc-calibrated.pdf")


def test_a_doubtful_row_is_marked_and_left_out_of_the_mean_of_those_that_pass(exact: Experiment) -> None:
    marks = {str(row.cells[0]): row.mark for row in score_table(exact, TITLE).rows}
    assert marks == {"A": "", "D": "doubtful", "F": "muted"}
    assert exact.passed["subject"].tolist() == ["A"]
