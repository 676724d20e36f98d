"""The comparison with the paper: complete, computed, and read by honest rules."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from comparison_case import recovery, study
from study_copy import StudyCopy

from swesbi.artefacts import ArtefactError
from swesbi.report.paper.comparison import (
    COLUMNS,
    MEASURES,
    READINGS,
    STATEMENT_COLUMNS,
    ReadingError,
    comparison_table,
    origin,
    read_difference,
    statements_table,
)
from swesbi.report.paper.study_values import Findings, StudyValue, differ, shown, spread
from swesbi.report.paper.values import PaperNumber, PaperRow, numbers, read_paper

PRINTED = (
    "12.61 5.55 1.14 0.38 89.7 4.2 2.16 69.7 3.14 178.6 0.996 0.001 4.84 0.76 84.2 0.020 0.60 0.99 "
    "12.67 1.40 89.0 0.025 0.995 1.35 0.98 15.33 0.87 94.3 0.016 0.998 17.59 1.53 91.3 0.027 1.77 "
    "0.89 0.84 0.15 0.09 0.12 0.03 92.5 90.5 26.5 1.36 2.15 2.06 2.02 1.0 0.5 5.0 0.6 0.45 0.26.1 6 "
    "4 300 1 20 1000 3 60 46 16 30 5 45 200 10 2 6000 120,000 50 128 100 90 400 12 80 9600 209"
)
"""Every number of the paper."""


@pytest.fixture(scope="module")
def results() -> Findings:
    return study()


@pytest.fixture(scope="module")
def table(results: Findings) -> pd.DataFrame:
    return comparison_table(read_paper(), results).set_index("quantity")


def row(table: pd.DataFrame, start: str) -> pd.Series:
    """The only row whose quantity starts like this."""
    found = table[[str(name).startswith(start) for name in table.index]]
    assert len(found) == 1, f"{start!r}: {list(found.index)}"
    return found.iloc[0]


def printed(**changes: object) -> PaperNumber:
    plain = {"quantity": "x", "where": "Sec. 3", "paper": "1.14 ± 0.38", "measure": "score_mean", "digits": 2}
    made = PaperRow.from_plain(plain | {"reading": "spread"} | changes)
    value, sd = numbers(made.paper)
    return PaperNumber("group", made, "", made.paper, value, sd)


def test_every_number_of_the_paper_has_a_row() -> None:
    prints = " ".join(part.printed for part in read_paper())
    for number in PRINTED.split():
        assert re.search(rf"(?<![\d.]){re.escape(number)}(?![\d]|\.\d)", prints), number


def test_table_1_is_complete_and_its_means_are_those_of_its_cases() -> None:
    paper = read_paper()
    table_1 = [part for part in paper if part.case]
    assert len(table_1) == 4 * (8 + 1), "the coverage in both readings, and the CMA-ES fit"
    for mean, column in (
        ("RMSE of the prior predictive median, mean", "rmse_prior_kpa"),
        ("RMSE of the posterior predictive median, mean", "rmse_kpa"),
        ("RMSE reduction, mean", "rmse_reduction_percent"),
        ("R2, mean", "r2"),
    ):
        values = [part.value for part in table_1 if part.row.of["column"] == column]
        said = next(part for part in paper if part.quantity.startswith(mean))
        assert np.mean(values) == pytest.approx(said.value, abs=0.51 * 10.0**-said.row.digits)
        assert np.std(values, ddof=1) == pytest.approx(said.sd, abs=10.0**-said.row.digits)


def test_every_cell_is_filled_and_no_quantity_comes_twice(table: pd.DataFrame) -> None:
    frame = table.reset_index()
    assert tuple(frame.columns) == COLUMNS == ("quantity", "paper", "this_study", "note", "origin")
    assert (frame.map(lambda cell: isinstance(cell, str) and bool(cell.strip()))).all(axis=None)
    assert frame["quantity"].is_unique and len(frame) == len(read_paper()) > 100
    assert not frame["this_study"].str.contains(r"\bnan\b").any()


def test_rows_name_all_measures_and_readings_and_what_they_compare() -> None:
    rows = [part.row for part in read_paper()]
    assert {part.measure for part in rows} == set(MEASURES)
    assert {part.reading for part in rows} == set(READINGS)
    for part in read_paper():
        assert part.row.reading == "words" or np.isfinite(part.value), part.quantity
        assert part.row.reading != "spread" or np.isfinite(part.sd), part.quantity


def test_designed_rows_name_the_place_of_the_choice(table: pd.DataFrame) -> None:
    said = table["origin"]
    assert (said.eq("found") | said.str.fullmatch(r"designed \(.{8,}\)")).all()
    for part in read_paper():
        assert (
            part.row.reading not in {"configured", "identity", "protocol"} or said[part.quantity] != "found"
        )
    for start in ("subjects that pass", "RMSE of the prior predictive median, mean", "noise-modelled feat"):
        assert row(table, start)["origin"].startswith("designed (")
    for start in ("r(k_0, k_SR)", "coverage of k_SR", "r(k_ATP, k_SR)", "supported cases where"):
        assert row(table, start)["origin"] == "found"


def test_a_setting_is_its_own_place(results: Findings) -> None:
    mine = replace(results, main="mine")
    configured = printed(of={"path": "experiment.prior.k0_kpa.low"})
    assert origin(configured, mine) == "designed (config.yaml: experiment mine, prior.k0_kpa.low)"
    of_search = {"path": "cmaes.generations"}
    assert origin(printed(of=of_search), mine) == "designed (config.yaml: cmaes.generations)"
    assert origin(printed(designed="here", of=of_search), mine) == "designed (here)"
    assert origin(printed(), mine) == "found"


def test_of_other_subjects_the_maker_of_the_volunteers_designs_nothing(results: Findings) -> None:
    others = replace(results, cohort_title="patients of a clinic")
    for part in read_paper():
        of_volunteers = "volunteers" in part.row.designed
        assert origin(part, results).startswith("designed") >= of_volunteers
        assert not (of_volunteers and origin(part, others) != "found")


def test_coverage_stands_in_both_readings(results: Findings, table: pd.DataFrame) -> None:
    scores = results.ppc[results.ppc["experiment"] == "paper"].set_index("subject")
    for start, column in (("as the band of noiseless curves", "noiseless"), ("with the noise", "observed")):
        told = row(
            table,
            f"coverage of the 90 % predictive interval, {start} of the observation model, case A"
            if column == "observed"
            else f"coverage of the 90 % predictive interval, {start}, case A",
        )
        assert told["this_study"] == f"{scores.loc['A', f'coverage_{column}_grid']:.2f}"


def test_the_configuration_is_the_paper_s(table: pd.DataFrame) -> None:
    configured = [part.quantity for part in read_paper() if part.row.reading == "configured"]
    assert len(configured) > 25
    for quantity in configured:
        assert table.loc[quantity, "note"].startswith("same by configuration"), quantity
    for part in read_paper():
        if part.row.reading == "identity":
            assert table.loc[part.quantity, "note"].startswith("same definition"), part.quantity


def test_a_changed_setting_is_told(results: Findings) -> None:
    experiment = results.design["experiment"]
    changed = experiment | {"support": experiment["support"] | {"max_abs_z": 2.5}}
    other = replace(results, design=dict(results.design) | {"experiment": changed})
    told = row(comparison_table(read_paper(), other).set_index("quantity"), "largest admitted |z|")
    assert told["note"].startswith("configured otherwise")


def test_means_are_over_the_supported_subjects(results: Findings, table: pd.DataFrame) -> None:
    scores = results.ppc[(results.ppc["experiment"] == "paper") & results.ppc["may_be_read"]]
    values = scores["rmse_prior_kpa"]
    assert len(values) == 4
    shown_mean = f"{values.mean():.2f} ± {values.std(ddof=1):.2f}"
    assert row(table, "RMSE of the prior predictive median, mean")["this_study"] == shown_mean
    assert row(table, "subjects that pass")["this_study"] == "4 of 6 (A, B, C, D)"


def test_an_excluded_subject_has_no_posterior_score() -> None:
    table = comparison_table(read_paper(), study("paper", excluded="BEF")).set_index("quantity")
    told = row(table, "RMSE of the posterior predictive median (kPa), case B")
    assert told["this_study"].startswith("none: B is not prior-supported") and "3.14" in told["this_study"]
    assert told["note"].startswith("no value to compare")
    prior = row(table, "RMSE of the prior predictive median (kPa), case B")["this_study"]
    assert re.fullmatch(r"\d+\.\d\d", prior)
    assert row(table, "RMSE of the CMA-ES best fit (kPa), case B")["this_study"][0].isdigit()
    assert row(table, "subjects that pass")["this_study"] == "3 of 6 (A, C, D)"


@pytest.mark.parametrize("excluded", ["ABC", "AB", ""])
def test_any_number_of_supported_subjects_fills_the_table(excluded: str) -> None:
    part = comparison_table(read_paper(), study("paper", subjects="ABC", excluded=excluded))
    assert (part.map(lambda cell: bool(str(cell).strip()))).all(axis=None)
    assert not part["this_study"].str.contains(r"\bnan\b").any()
    told = row(part.set_index("quantity"), "RMSE of the posterior predictive median, mean")
    if excluded == "ABC":
        assert told["this_study"] == "none: no subject is prior-supported"
    if excluded == "AB":
        assert told["this_study"].endswith("(one subject)")
    assert "no subject D" in row(part.set_index("quantity"), "NRMSE, case D")["this_study"]


def test_experiments_that_were_not_run_are_said(table: pd.DataFrame) -> None:
    alone = comparison_table(read_paper(), study("paper")).set_index("quantity")
    for start in ("scalar-only", "wider priors", "wider timing"):
        assert "was not run" in row(alone, start)["this_study"]
        assert "was not run" not in row(table, start)["this_study"]


def test_statements_follow_the_numbers(results: Findings) -> None:
    scores = results.ppc.copy()
    scores.loc[scores["experiment"] == "scalar_only", "rmse_kpa"] *= 2.0
    posterior = results.posterior.copy()
    wide = (posterior["experiment"] == "wide_prior") & (posterior["parameter"] == "k_atp_per_s")
    for name in ("median", "ci_low", "ci_high"):
        posterior.loc[wide & (posterior["subject"] == "A"), name] *= 3.0
    recoveries = dict(results.recoveries) | {"wide_prior": recovery(0.92, 0.70, 0.27)}
    changed = replace(results, ppc=scores, posterior=posterior, recoveries=recoveries)
    table = comparison_table(read_paper(), changed).set_index("quantity")
    assert row(table, "scalar-only")["this_study"].startswith("yes: RMSE mean ")
    assert row(table, "wider priors")["this_study"].startswith("in 1 of 4: median A ")
    assert row(table, "wider priors")["note"].startswith("holds in part")
    assert row(table, "wider timing")["this_study"].startswith("yes: ")
    same = comparison_table(read_paper(), results).set_index("quantity")
    assert row(same, "scalar-only")["this_study"].startswith("no: RMSE mean ")
    assert row(same, "wider priors")["note"].startswith("differs from the paper")
    assert row(same, "wider timing")["this_study"].startswith("no: ")


@pytest.mark.parametrize(
    ("narrow", "wide", "said"),
    [(0.965, 0.918, "no"), (0.92, 0.99, "no"), (0.27, 0.6, "no"), (0.97, 0.8, "yes")],
)
def test_coverage_degrades_by_falling_below_nominal_alone(
    results: Findings, narrow: float, wide: float, said: str
) -> None:
    tables = {"paper": recovery(0.92, 0.90, narrow), "wide_prior": recovery(0.92, 0.90, wide)}
    changed = replace(results, recoveries=dict(results.recoveries) | tables)
    table = comparison_table(read_paper(), changed).set_index("quantity")
    assert row(table, "wider timing")["this_study"].startswith(f"{said}: ")


def test_spread_reading() -> None:
    inside = read_difference(printed(), StudyValue("1.40 ± 0.2", 1.40, 0.2), "virtual volunteers")
    assert inside.agrees and inside.words == "within the paper's spread"
    outside = read_difference(printed(), StudyValue("2.03 ± 0.7", 2.03, 0.7), "virtual volunteers")
    assert not outside.agrees
    assert outside.words.startswith("outside the paper's spread: higher by 0.89; virtual volunteers")
    remark = read_difference(printed(remark="Why."), StudyValue("1.2", 1.2), "x")
    assert remark.words == "within the paper's spread. Why."


@pytest.mark.parametrize(
    ("value", "scored", "start"),
    [(94.0, 400, "no difference"), (75.0, 400, "lower by 17.5"), (75.0, 4, "no difference")],
)
def test_binomial_reading(value: float, scored: int, start: str) -> None:
    number = printed(paper="92.5", reading="binomial", digits=1)
    told = read_difference(number, StudyValue("", value, n=scored), "")
    assert told.words.startswith(start) and told.agrees == (start == "no difference")


def test_a_statement_agrees_where_each_of_its_numbers_does(results: Findings) -> None:
    """Broken one by one: a mean, a case, a count, an order, a yes."""
    table = statements_table(read_paper(), results)
    assert tuple(table.columns) == STATEMENT_COLUMNS and len(table) == 23 and table["statement"].is_unique
    agrees = table.set_index("statement")["agrees"]
    scores, posterior = results.ppc.copy(), results.posterior.copy()
    of = scores["experiment"].eq("paper")
    scores.loc[of, "rmse_prior_kpa"] += 20.0
    scores.loc[of & scores["subject"].eq("B"), "coverage_observed_grid"] = 0.92
    scores.loc[of & scores["subject"].eq("A"), "post_peak_rmse_kpa"] = 9.0
    for one, other in (("k0_kpa", "k_sr_per_s"), ("k_sr_per_s", "k0_kpa")):
        posterior.loc[posterior["parameter"] == one, f"correlation_{other}"] = 0.5
    low = dict(results.recoveries) | {"paper": recovery(0.92, 0.80, 0.27)}
    excluded = replace(results.verdicts["A"], status=results.verdicts["E"].status)
    verdicts = dict(results.verdicts) | {"A": excluded}
    broken = replace(results, ppc=scores, posterior=posterior, recoveries=low, verdicts=verdicts)
    lost = agrees[agrees != statements_table(read_paper(), broken).set_index("statement")["agrees"]]
    assert lost.eq("yes").all()
    assert set(lost.index) == {
        "four of six subjects have prior support",
        "RMSE of the prior's median (kPa)",
        "intervals of A to C contain nearly all of the curve",
        "the RMSE after the peak is largest in D",
        "r(k_0, k_SR)",
        "recovery of k_ATP (%)",
    }


def test_the_two_excluded_cases_are_the_paper_s_by_the_way_they_fail(results: Findings) -> None:
    def told(**changes: dict[str, object]) -> list[str]:
        verdicts = {
            name: replace(verdict, **changes.get(name, {})) for name, verdict in results.verdicts.items()
        }
        table = statements_table(read_paper(), replace(results, verdicts=verdicts)).set_index("statement")
        return [str(table["agrees"][name]) for name in table.index if "fails by" in name]

    medians = {name: dict(results.verdicts[name].unfiltered_median) | {"k_atp_per_s": 70.0} for name in "EF"}
    first = {"max_abs_z": 2.16, "in_prior_draws": 1, "unfiltered_median": medians["E"]}
    second = {"max_abs_z": 3.14, "in_prior_draws": 0, "unfiltered_median": medians["F"]}
    slope = {"worst_component": "max_up_slope_kpa_per_cycle"}
    assert told(E=first, F=second | slope) == ["yes", "yes"]
    assert told(F=first, E=second | slope) == ["yes", "yes"]
    assert told(E=first | {"in_prior_draws": 1000}, F=second | slope) == ["no", "yes"]
    assert told(E=first | {"max_abs_z": 3.1}, F=second | slope) == ["no", "yes"]
    assert told(E=first, F=second | {"worst_component": "auc_kpa"}) == ["yes", "no"]
    assert told(E=first, F=second | slope | {"in_prior_draws": 1}) == ["yes", "no"]


@pytest.mark.parametrize(
    ("paper", "value", "agrees"),
    [
        (">0.99", 0.95, True),
        (">0.99", 0.93, False),
        (">0.99", 1.0, True),
        ("0.89", 0.93, True),
        ("0.89", 0.95, False),
    ],
)
def test_a_coverage_agrees_within_one_phase(paper: str, value: float, agrees: bool) -> None:
    assert read_difference(printed(paper=paper, reading="phase"), StudyValue("", value), "").agrees == agrees


def test_case_reading() -> None:
    above = printed(paper=">0.99", reading="case")
    for value, words in ((1.0, "above 0.99 too"), (0.01, "lower by 0.98")):
        told = read_difference(above, StudyValue("", value), "").words
        assert told == f"{words}; another subject than the paper's"
    exact = printed(paper="1.40", reading="case")
    assert read_difference(exact, StudyValue("1.40", 1.4013), "").words.startswith(
        "equal to the digits printed"
    )


def test_an_unknown_rule_is_refused(results: Findings) -> None:
    with pytest.raises(ReadingError, match="no reading"):
        read_difference(printed(reading="guess"), StudyValue("1", 1.0), "")
    with pytest.raises(ReadingError, match="no measure 'guess'"):
        comparison_table([printed(measure="guess")], results)


def test_two_frequencies_differ_beyond_their_errors() -> None:
    assert not differ(0.925, 400, 0.940, 400) and not differ(0.5, 400, 0.5, 10)
    assert differ(0.265, 400, 0.928, 400) and differ(0.928, 400, 0.265, 400)
    assert not differ(1.0, 3, 0.7, 400) and differ(1.0, 400, 0.9, 400)


def test_binomial_error_has_its_size() -> None:
    rng = np.random.default_rng(0)
    one, other = rng.binomial(400, 0.9, (2, 4000)) / 400
    rate = np.mean([differ(a, 400, b, 400) for a, b in zip(one, other, strict=True)])
    assert 0.03 < rate < 0.065


def test_printed_numbers() -> None:
    assert numbers("12.61 ± 5.55") == (12.61, 5.55)
    assert numbers("-0.84 ± 0.15") == (-0.84, 0.15)
    assert numbers("120,000")[0] == 120_000 and numbers(">0.99")[0] == 0.99
    assert np.isnan(numbers("yes")).all()


def test_numbers_are_shown_without_a_negative_zero() -> None:
    assert [shown(-0.001, 2), shown(-0.84, 2), shown(120_000, 0)] == ["0.00", "-0.84", "120,000"]
    assert spread([1.0, 3.0], printed(digits=1)).text == "2.0 ± 1.4"


def test_a_wrong_data_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "paper_values.yaml"
    path.write_text("- group: a\n  rows:\n    - {quantity: b, where: c, measure: d, digits: 0, reading: e}\n")
    with pytest.raises(ArtefactError, match="give `paper` or `cases`"):
        read_paper(path)


def test_a_finished_study_has_its_comparison(finished: StudyCopy) -> None:
    table = pd.read_csv(finished.results / "tables" / "paper_comparison.csv", keep_default_na=False)
    assert tuple(table.columns) == COLUMNS and len(table) == len(read_paper())
    assert (table != "").all(axis=None)
    assert row(table.set_index("quantity"), "subjects evaluated")["this_study"] == "2 virtual volunteers"
    rows = row(table.set_index("quantity"), "pooled training samples")
    assert rows["this_study"] == "480" and rows["note"].startswith("lower by")
