"""The page's section on experiments on speeds: numbers and verdicts."""

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

from swesbi.checks.calibration.alarms import ALARMS
from swesbi.checks.calibration.table import COLUMNS as CALIBRATION_COLUMNS
from swesbi.parameters import PHI_NAMES, THETA_NAMES
from swesbi.recording.noise.cohort import CohortNoise, GroupNoise, NoiseEstimate
from swesbi.recording.noise.components import ComponentEstimate
from swesbi.report.figures.style import save_figure
from swesbi.report.page.landing import limits
from swesbi.report.page.sections import make_section, section_figures
from swesbi.report.results import Experiment, no_rows
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


def make_exact_experiment() -> Experiment:
    supported = {name: STATUS.get(name) != "contradicted" for name in SUBJECTS}
    plain = make_experiment("calibrated", supported)
    settings = {
        "exact": {"interval": 0.9},
        "predictive": {"interval": 0.9},
        "observation_model": {"discrepancy": {"speed_fraction": 0.02, "timing_cycle": 0.015}},
    }
    return replace(plain, settings=settings, verdicts={name: verdict(name) for name in SUBJECTS})


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


def alarms() -> pd.DataFrame:
    kinds = (("model_noise", 0.055), ("sample_by_sample", 0.06))
    return pd.DataFrame(
        [
            {
                "recordings": made, "alarm": alarm, "rate": rate, "ci_low": rate / 2,
                "ci_high": min(1.0, 2 * rate), "n": 200,
            }
            for made, rate in kinds
            for alarm in ALARMS
        ]
    )  # fmt: skip


def identifiability() -> pd.DataFrame:
    return pd.DataFrame(
        [
            {
                "subject": subject, "quantity": name, "median": 5.0, "sd_log": 0.123, "contraction": 0.8,
                "contraction_log": 0.812, "expected_sd_log": 0.13, "sensitivity_prior": 0.06,
                "sensitivity_likelihood": 0.07 if name == "k_atp_per_s" else 0.02,
                "sensitivity_nuisances": 0.04, "width_4": 0.94, "correlated_with": "speed_scale",
                "correlation": -0.951,
            }
            for subject in SUBJECTS
            for name in PHI_NAMES
        ]
    )  # fmt: skip


def truth() -> pd.DataFrame:
    rows = [
        {"experiment": "calibrated", "subject": name, "status": STATUS.get(name, "not contradicted"),
         "parameter": parameter, "truth": 5.5, "median": 5.0, "low": 4.0, "high": 6.0, "inside": name == "A"}
        for name in SUBJECTS
        for parameter in THETA_NAMES
    ]  # fmt: skip
    table = pd.DataFrame(rows)
    table.loc[table["subject"] == "F", ["median", "low", "high"]] = np.nan
    table["inside"] = table["inside"].astype(object)
    table.loc[table["subject"] == "F", "inside"] = None
    return table


def noise() -> CohortNoise:
    parts = [ComponentEstimate(size, 0.001, 0.9 * size, 1.1 * size) for size in (0.0443, 0.0794)]
    estimate = NoiseEstimate(*parts, repeats=330, samples=3700)
    return CohortNoise({"others": GroupNoise(estimate, dict.fromkeys(SUBJECTS, estimate), 0.62)}, 0.9)


@pytest.fixture
def exact() -> Experiment:
    return replace(
        make_exact_experiment(),
        results={name: result(name, 200) for name in SUBJECTS},
        calibration=calibration(),
        alarms=alarms(),
        identifiability=identifiability(),
        noise=noise(),
        truth=truth(),
    )


def test_verdicts_stand_with_the_reliability_of_their_draws(exact: Experiment) -> None:
    rows = verdicts_table(exact, TITLE).rows
    assert [row.mark for row in rows] == ["", "doubtful", "muted"]
    assert rows[1].cells[:4] == ("D", "doubtful", "residuals (p = 0.0002)", "importance weights")
    assert rows[0].cells[4:] == ("0.31", "82", "–", "yes")
    against = ("residuals", "mass at a bound")
    assert rows[2].cells[1:7] == (
        "contradicted", ", ".join(f"{name} (p = 0.0002)" for name in against), "MCMC", "inf", "2", "1.004",
    )  # fmt: skip


def test_flagged_tests_are_bold_and_tests_without_a_p_value_show_their_statistic(exact: Experiment) -> None:
    rows = {str(row.cells[0]): row.cells[1:] for row in outcomes_table(exact, TITLE).rows}
    assert rows["residuals"] == ("0.40", Strong("0.00020"), Strong("0.00020"))
    assert rows["mass at a bound"] == ("0.40", "0.40", Strong("0.00020"))
    assert rows["end systolic volume"] == ("1.2", "1.2", "1.2")


def test_the_section_counts_what_failed_and_what_lies_inside(exact: Experiment) -> None:
    section = make_section(exact, {}, TITLE)
    facts = section.facts
    assert facts["Verdicts"] == "1 not contradicted (A), 1 doubtful (D), 1 contradicted (F)"
    assert facts["Exact posteriors"].endswith("by MCMC: F")
    assert facts["Truth of the simulated recordings"] == "inside 3 of 6 intervals"
    shown = {
        str(row.cells[0]) + str(row.cells[1]): row.cells[2:] for row in section.tables["calibration"].rows
    }
    own = shown["the model's own noiseexact weights"]
    assert own == ("1 of 4", "1 of 3", "87.5", "87.5", "87.5", "90.5", "12")
    assert shown["at the subject's own datanetwork alone"][0] == "–"
    failed = [row.cells[4] for row in section.tables["checks"].rows]
    assert failed == ["k_SR"] * 6
    rates = [row.cells[1] for row in section.tables["alarms"].rows]
    assert rates[0] == "5.5 (2.8 to 11.0)" and len(rates) == 2
    assert section.tables["identifiability"].rows[0].cells[2:] == (
        "0.812", "0.06", "0.04", "0.02", "12.3", "13.0", "94", "scale of all speeds (−0.95)"
    )  # fmt: skip
    assert section.tables["noise"].rows[0].cells == ("between repeats", "4.43", "0.10", "3.99 to 4.87")
    assert [row.mark for row in section.tables["posterior"].rows] == [""] * 4 + ["doubtful"] * 4 + [
        "muted"
    ] * 4


def test_a_parameter_that_prior_and_likelihood_move_is_said_to_be_disputed(exact: Experiment) -> None:
    said = list(limits(exact, "A"))
    assert [text for text in said if "disagree" in text] == ["prior and recording disagree on k_ATP"]
    assert not any("disagree" in text for text in limits(replace(exact, settings={"posterior": {}}), "A"))


def test_truth_of_the_contradicted_is_shown_without_an_answer(exact: Experiment) -> None:
    rows = exact_table(exact, TITLE).rows
    assert [str(row.cells[6]) for row in rows] == [*["yes"] * 3, "–", *["no"] * 3, "–", *["–"] * 4]
    assert [row.cells[5] for row in rows[-4:]] == ["5.50"] * 3 + ["–"]
    recorded = replace(exact, truth=no_rows())
    heads = [column.head for column in exact_table(recorded, TITLE).columns]
    assert (
        "Truth" not in heads
        and "Truth of the simulated recordings" not in make_section(recorded, {}, TITLE).facts
    )


def test_tables_of_all_experiments_take_both_kinds(exact: Experiment) -> None:
    paper, calibrated = make_experiment("paper", dict.fromkeys(SUBJECTS, True)), exact
    rows = differences_table([calibrated], paper).rows
    assert [row.cells for row in rows] == [
        ("calibrated", "kind", "noise on features", "noise on the measured speeds")
    ]
    both = [paper, calibrated]
    assert comparison_table(both, TITLE).rows[0].cells[2] == "2 of 3 (A, D)"
    assert posterior_table(both, TITLE).rows[-1].cells[3:6] == ("calibrated", "–", "–")
    assert len(recovery_table(both).rows) == 12 and len(training_table(both).rows) == 2


def test_figures_are_found_by_kind_and_experiment(tmp_path: Path) -> None:
    names = ("ppc-calibrated", "ppc-other", "noise", "identifiability-calibrated")
    pngs = [tmp_path / f"{name}.png" for name in names]
    for png in pngs:
        save_figure(Drawing(figsize=(2.0, 1.0)), png)
    found = section_figures("speeds", pngs, "calibrated", tmp_path / "index.html", TITLE)
    assert sorted(found) == ["identifiability", "noise", "ppc"]
    assert (found["ppc"].source, found["ppc"].full) == ("ppc-calibrated.png", "ppc-calibrated.pdf")
    assert TITLE in found["ppc"].caption


def test_a_doubtful_row_is_marked_and_left_out_of_the_mean_of_those_that_pass() -> None:
    experiment = make_exact_experiment()
    rows = score_table(experiment, TITLE).rows
    doubtful = {name for name in SUBJECTS if STATUS.get(name) == "doubtful"}
    assert doubtful
    assert {str(row.cells[0]) for row in rows if row.mark == "doubtful"} == doubtful
    assert doubtful.isdisjoint(experiment.passed["subject"])
    assert len(experiment.passed)
