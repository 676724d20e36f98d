"""The small study agrees with its stored tables: recovery, posteriors and verdicts of every experiment, and
what they are made from. ``reference_tables`` says how far a number may move; ``make reference`` renews them.
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from reference_tables import (
    COHORT,
    EVERY,
    FEATURES,
    MONTE_CARLO_ERRORS,
    OF_PAPER,
    SMALL_STUDY,
    SUBJECTS,
    differences,
    small_study,
    store,
    stored,
)
from study_copy import StudyCopy


@pytest.fixture(scope="module")
def numbers(finished: StudyCopy) -> pd.DataFrame:
    return small_study(finished.results)


def test_the_small_study_agrees_with_the_stored_tables(numbers: pd.DataFrame) -> None:
    apart = differences(numbers, SMALL_STUDY)
    assert apart.empty, f"{len(apart)} numbers differ by more than is allowed:\n{apart.to_string()}"


def test_every_experiment_is_stored() -> None:
    tables = stored(SMALL_STUDY)
    assert set(tables["experiment"]) == {COHORT, *EVERY}
    for experiment in EVERY:
        rows = tables[tables["experiment"] == experiment]
        artefacts = set(rows["quantity"].str.partition("/")[0])
        of_draws = {"recovery", "recovery_acquisition"} if experiment in FEATURES else set()
        assert {"posterior", "verdict", "predictive"} | of_draws <= artefacts
        subjects = OF_PAPER if experiment in FEATURES else SUBJECTS
        assert set(subjects) <= set(rows["subject"])


@pytest.mark.parametrize(
    ("quantity", "factor"),
    [
        ("simulations/peak_kpa[0]", 1.0 + 1e-5),
        ("noise/fraction[others,repeat]", 1.001),
        ("cmaes/theta[k_sr_per_s]", 1.001),
        ("passive/scale_kpa", -1.0),
    ],
)
def test_a_number_that_moved_is_named(
    numbers: pd.DataFrame, tmp_path: Path, quantity: str, factor: float
) -> None:
    table = edited_tables(numbers, tmp_path)
    row = table.index[table["quantity"] == quantity][0]
    table.loc[row, "value"] = f"{float(table.loc[row, 'value']) * factor:.12g}"
    table.to_csv(tmp_path / f"{COHORT}.csv", index=False)
    apart = differences(numbers, tmp_path)
    assert apart["quantity"].tolist() == [quantity]
    assert apart["excess"].item() > 1.0


def test_a_number_within_its_tolerance_is_not_named(numbers: pd.DataFrame, tmp_path: Path) -> None:
    table = edited_tables(numbers, tmp_path)
    row = table.index[table["quantity"] == "simulations/peak_kpa[0]"][0]
    table.loc[row, "value"] = f"{float(table.loc[row, 'value']) * (1.0 + 1e-7):.12g}"
    table.to_csv(tmp_path / f"{COHORT}.csv", index=False)
    assert differences(numbers, tmp_path).empty


@pytest.mark.parametrize(("errors", "named"), [(0.9, []), (1.1, ["posterior/median[k0_kpa]"])])
def test_a_number_of_a_sampler_moves_by_its_monte_carlo_errors(
    numbers: pd.DataFrame, tmp_path: Path, errors: float, named: list[str]
) -> None:
    store(numbers, tmp_path)
    path = tmp_path / "calibrated.csv"
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    row = table.index[table["quantity"] == "posterior/median[k0_kpa]"][0]
    value, error = float(table.loc[row, "value"]), float(table.loc[row, "error"])
    assert 0.0 < error < 0.1 * value
    moved = errors * (MONTE_CARLO_ERRORS * error + 1e-3 * value + 1e-4)
    table.loc[row, "value"] = f"{value + moved:.12g}"
    table.to_csv(path, index=False)
    assert differences(numbers, tmp_path)["quantity"].tolist() == named


@pytest.mark.parametrize("value", ["", "nan", "inf", "many"])
def test_a_value_that_is_no_number_agrees_with_none(
    numbers: pd.DataFrame, tmp_path: Path, value: str
) -> None:
    table = edited_tables(numbers, tmp_path)
    table.loc[0, "value"] = value
    table.to_csv(tmp_path / f"{COHORT}.csv", index=False)
    assert differences(numbers, tmp_path)["quantity"].tolist() == [table.loc[0, "quantity"]]


def test_a_number_that_one_side_lacks_is_named(numbers: pd.DataFrame, tmp_path: Path) -> None:
    table = edited_tables(numbers, tmp_path)
    lacking = table["quantity"][:2].tolist()
    table.loc[0, "quantity"] = "observation/another"
    table.drop(index=1).to_csv(tmp_path / f"{COHORT}.csv", index=False)
    named = differences(numbers, tmp_path)["quantity"]
    assert sorted(named) == sorted(["observation/another", *lacking])


def edited_tables(numbers: pd.DataFrame, folder: Path) -> pd.DataFrame:
    """Store the small study's own tables in a folder and return the cohort's, to be edited."""
    store(numbers, folder)
    return pd.read_csv(folder / f"{COHORT}.csv", dtype=str, keep_default_na=False)
