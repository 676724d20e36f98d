from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from comparison_case import recovery, study

from swesbi.report.paper.comparison import (
    COLUMNS,
    STATEMENT_COLUMNS,
    comparison_table,
    origin,
    read_difference,
    statements_table,
)
from swesbi.report.paper.values import (
    Findings,
    PaperNumber,
    PaperRow,
    StudyValue,
    differ,
    numbers,
    read_paper,
    shown,
    spread,
)

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
    return PaperNumber(made, "", made.paper, value, sd)


def test_every_number_of_the_paper_has_a_row() -> None:
    prints = " ".join(part.printed for part in read_paper())
    for number in PRINTED.split():
        assert re.search(rf"(?<![\d.]){re.escape(number)}(?![\d]|\.\d)", prints), number


def test_a_row_of_nothing_that_the_paper_prints_is_refused() -> None:
    with pytest.raises(ValueError, match="give `paper` or `cases`"):
        printed(paper="")


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
    assert tuple(frame.columns) == COLUMNS
    assert (frame.map(lambda cell: isinstance(cell, str) and bool(cell.strip()))).all(axis=None)
    assert frame["quantity"].is_unique and len(frame) == len(read_paper()) > 100
    assert not frame["this_study"].str.contains(r"\bnan\b").any()


def test_designed_rows_name_the_place_of_the_choice(table: pd.DataFrame) -> None:
    said = table["origin"]
    assert (said.eq("found") | said.str.fullmatch(r"designed \(.{8,}\)")).all()
    chosen = [part for part in read_paper() if part.row.reading in {"configured", "identity", "protocol"}]
    assert [part.quantity for part in chosen if said[part.quantity] == "found"] == []


def test_a_setting_is_its_own_place(results: Findings) -> None:
    mine = replace(results, main="mine")
    configured = printed(path="experiment.prior.k0_kpa.low")
    assert origin(configured, mine) == "designed (config.yaml: experiment mine, prior.k0_kpa.low)"
    of_search = "cmaes.generations"
    assert origin(printed(path=of_search), mine) == "designed (config.yaml: cmaes.generations)"
    assert origin(printed(designed="here", path=of_search), mine) == "designed (here)"
    assert origin(printed(), mine) == "found"


def test_of_other_subjects_the_maker_of_the_volunteers_designs_nothing(results: Findings) -> None:
    others = replace(results, cohort_title="patients of a clinic")
    for part in read_paper():
        of_volunteers = "volunteers" in part.row.designed
        assert origin(part, results).startswith("designed") >= of_volunteers
        assert not (of_volunteers and origin(part, others) != "found")


def test_the_configuration_is_the_paper_s(table: pd.DataFrame) -> None:
    for reading, words, least in (("configured", "same by conf", 26), ("identity", "same definition", 1)):
        notes = [table.loc[part.quantity, "note"] for part in read_paper() if part.row.reading == reading]
        assert len(notes) >= least
        assert [note for note in notes if not note.startswith(words)] == []


def test_means_are_over_the_supported_subjects(results: Findings, table: pd.DataFrame) -> None:
    scores = results.ppc[(results.ppc["experiment"] == "paper") & results.ppc["may_be_read"]]
    told = row(table, "RMSE of the prior predictive median, mean")["this_study"]
    assert told == "{mean:.2f} ± {std:.2f}".format(**scores["rmse_prior_kpa"].agg(["mean", "std"]))
    assert row(table, "subjects that pass")["this_study"] == "4 of 6 (A, B, C, D)"


def test_an_excluded_subject_has_no_posterior_score() -> None:
    table = comparison_table(read_paper(), study("paper", excluded="BEF")).set_index("quantity")
    told = row(table, "RMSE of the posterior predictive median (kPa), case B")
    assert told["this_study"].startswith("none: B is not prior-supported") and "3.14" in told["this_study"]
    assert told["note"].startswith("no value to compare")
    assert row(table, "RMSE of the prior predictive median (kPa), case B")["this_study"][0].isdigit()
    assert row(table, "subjects that pass")["this_study"] == "3 of 6 (A, C, D)"
    others = [row(table, start)["this_study"] for start in ("scalar-only", "wider priors", "wider timing")]
    assert all("was not run" in said for said in others)


@pytest.mark.parametrize(
    ("excluded", "said"),
    [("ABC", r"none: no subject is prior-supported"), ("AB", r".* \(one subject\)"), ("", r"\S+ ± \S+")],
)
def test_any_number_of_supported_subjects_fills_the_table(excluded: str, said: str) -> None:
    part = comparison_table(read_paper(), study("paper", subjects="ABC", excluded=excluded))
    told = row(part.set_index("quantity"), "RMSE of the posterior predictive median, mean")
    assert re.fullmatch(said, told["this_study"])
    assert "no subject D" in row(part.set_index("quantity"), "NRMSE, case D")["this_study"]


def test_statements_follow_the_numbers(results: Findings, table: pd.DataFrame) -> None:
    scores, posterior = results.ppc.copy(), results.posterior.copy()
    scores.loc[scores["experiment"] == "scalar_only", "rmse_kpa"] *= 2.0
    wide = (posterior["experiment"] == "wide_prior") & (posterior["parameter"] == "k_atp_per_s")
    moved = wide & (posterior["subject"] == "A")
    posterior.loc[moved, ["median", "ci_low", "ci_high"]] *= 3.0
    changed = replace(results, ppc=scores, posterior=posterior)
    other = comparison_table(read_paper(), changed).set_index("quantity")
    assert row(other, "scalar-only")["this_study"].startswith("yes: RMSE mean ")
    assert row(other, "wider priors")["this_study"].startswith("in 1 of 4: median A ")
    assert row(other, "wider priors")["note"].startswith("holds in part")
    assert row(table, "scalar-only")["this_study"].startswith("no: RMSE mean ")
    assert row(table, "wider priors")["note"].startswith("differs from the paper")


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


@pytest.mark.parametrize(
    ("reading", "paper", "value", "scored", "agrees", "words"),
    [
        ("configured", "3.0", 3.0, 0, True, "same by configuration"),
        ("configured", "3.0", 2.5, 0, False, "configured otherwise"),
        ("spread", "1.14 ± 0.38", 1.40, 0, True, "within the paper's spread"),
        ("spread", "1.14 ± 0.38", 2.03, 0, False, "outside .* higher by 0.89; virtual volunteers"),
        ("binomial", "92.5", 94.0, 400, True, "no difference"),
        ("binomial", "92.5", 75.0, 400, False, "lower by 17.50"),
        ("binomial", "92.5", 75.0, 4, True, "no difference"),
        ("phase", ">0.99", 0.95, 0, True, "lower by 0.04"),
        ("phase", ">0.99", 0.93, 0, False, "lower by 0.06"),
        ("phase", ">0.99", 1.0, 0, True, "above 0.99 too"),
        ("phase", "0.89", 0.93, 0, True, "higher by 0.04"),
        ("phase", "0.89", 0.95, 0, False, "higher by 0.06"),
        ("case", ">0.99", 1.0, 0, True, "above 0.99 too; another subject"),
        ("case", ">0.99", 0.01, 0, False, "lower by 0.98; another subject"),
        ("case", "1.40", 1.4013, 0, True, "equal to the digits printed"),
    ],
)
def test_a_difference_is_read_by_the_rule_of_its_row(
    reading: str, paper: str, value: float, scored: int, agrees: bool, words: str
) -> None:
    asked = printed(reading=reading, paper=paper, remark="Why.")
    told = read_difference(asked, StudyValue("", value, n=scored), "virtual volunteers")
    assert told.agrees == agrees and re.match(f"{words}.*Why[.]", told.words)


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


CLOSE = {"max_abs_z": 2.16, "in_prior_draws": 1}
FAR = {"max_abs_z": 3.14, "in_prior_draws": 0}
SLOPE = FAR | {"worst_component": "max_up_slope_kpa_per_cycle"}


@pytest.mark.parametrize(
    ("e", "f", "said"),
    [
        (CLOSE, SLOPE, ["yes", "yes"]),
        (SLOPE, CLOSE, ["yes", "yes"]),
        (CLOSE | {"in_prior_draws": 1000}, SLOPE, ["no", "yes"]),
        (CLOSE | {"max_abs_z": 3.1}, SLOPE, ["no", "yes"]),
        (CLOSE, FAR | {"worst_component": "auc_kpa"}, ["yes", "no"]),
        (CLOSE, SLOPE | {"in_prior_draws": 1}, ["yes", "no"]),
    ],
)
def test_the_two_excluded_cases_are_the_paper_s_by_the_way_they_fail(
    results: Findings, e: dict[str, object], f: dict[str, object], said: list[str]
) -> None:
    verdicts = dict(results.verdicts)
    for name, changes in {"E": e, "F": f}.items():
        median = dict(verdicts[name].unfiltered_median) | {"k_atp_per_s": 70.0}
        verdicts[name] = replace(verdicts[name], unfiltered_median=median, **changes)
    table = statements_table(read_paper(), replace(results, verdicts=verdicts)).set_index("statement")
    assert table.loc[table.index.str.contains("fails by"), "agrees"].tolist() == said


def test_two_frequencies_differ_beyond_their_errors() -> None:
    """Every twentieth pair does by chance; few recordings tell nothing, even where all are inside."""
    rng = np.random.default_rng(0)
    one, other = rng.binomial(400, 0.9, (2, 4000)) / 400
    rate = np.mean([differ(a, 400, b, 400) for a, b in zip(one, other, strict=True)])
    assert 0.03 < rate < 0.065
    assert differ(0.265, 400, 0.928, 400) and differ(0.928, 400, 0.265, 400)
    assert not differ(1.0, 3, 0.7, 400) and differ(1.0, 400, 0.9, 400)


def test_printed_numbers_are_read_and_shown_without_a_negative_zero() -> None:
    assert [numbers("12.61 ± 5.55"), numbers("-0.84 ± 0.15")] == [(12.61, 5.55), (-0.84, 0.15)]
    assert numbers("120,000")[0] == 120_000 and numbers(">0.99")[0] == 0.99
    assert np.isnan(numbers("yes")).all()
    assert [shown(-0.001, 2), shown(-0.84, 2), shown(120_000, 0)] == ["0.00", "-0.84", "120,000"]
    assert spread([1.0, 3.0], printed(digits=1)).text == "2.0 ± 1.4"
