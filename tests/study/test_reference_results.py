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
        assert {"recovery", "recovery_acquisition", "posterior", "support", "predictive"} <= artefacts
        subjects = OF_PAPER if experiment in FEATURES else SUBJECTS
        assert set(subjects) <= set(rows["subject"])


@pytest.mark.parametrize(
    ("quantity", "factor"),
    [
        ("simulations/peak_kpa[0]", 1.0 + 1e-5),
        ("noise/fraction[repeat]", 1.001),
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
