"""The small study agrees with its stored tables: recovery, posteriors and verdicts of every experiment, and
what they are made from. ``reference_tables`` says how far a number may move; ``make reference`` renews them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
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


def with_value(numbers: pd.DataFrame, folder: Path, experiment: str, quantity: str, value: str) -> list[str]:
    """Store the tables with another value of the first such quantity; return what then differs."""
    store(numbers, folder)
    path = folder / f"{experiment}.csv"
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    table.loc[table.index[table["quantity"] == quantity][0], "value"] = value
    table.to_csv(path, index=False)
    return list(differences(numbers, folder)["quantity"])


def first_of(numbers: pd.DataFrame, experiment: str, quantity: str) -> pd.Series:
    return numbers[(numbers["experiment"] == experiment) & (numbers["quantity"] == quantity)].iloc[0]


@pytest.mark.parametrize(
    ("quantity", "factor", "is_named"),
    [
        ("simulations/peak_kpa[0]", 1.0 + 1e-5, True),
        ("simulations/peak_kpa[0]", 1.0 + 1e-7, False),
        ("noise/fraction[others,repeat]", 1.001, True),
        ("cmaes/theta[k_sr_per_s]", 1.001, True),
        ("passive/scale_kpa", -1.0, True),
        ("passive/scale_kpa", np.nan, True),
        ("passive/scale_kpa", np.inf, True),
    ],
)
def test_a_number_that_moved_beyond_its_tolerance_is_named(
    numbers: pd.DataFrame, tmp_path: Path, quantity: str, factor: float, is_named: bool
) -> None:
    value = factor * float(first_of(numbers, COHORT, quantity)["value"])
    named = with_value(numbers, tmp_path, COHORT, quantity, f"{value:.12g}")
    assert named == ([quantity] if is_named else [])


@pytest.mark.parametrize(("errors", "is_named"), [(0.9, False), (1.1, True)])
def test_a_number_of_a_sampler_moves_by_its_monte_carlo_errors(
    numbers: pd.DataFrame, tmp_path: Path, errors: float, is_named: bool
) -> None:
    quantity = "posterior/median[k0_kpa]"
    row = first_of(numbers, "calibrated", quantity)
    value, error = float(row["value"]), float(row["error"])
    assert 0.0 < error < 0.1 * value
    moved = value + errors * (MONTE_CARLO_ERRORS * error + 1e-3 * value + 1e-4)
    named = with_value(numbers, tmp_path, "calibrated", quantity, f"{moved:.12g}")
    assert named == ([quantity] if is_named else [])


def test_a_word_in_place_of_a_number_and_a_number_that_one_side_lacks_are_named(
    numbers: pd.DataFrame, tmp_path: Path
) -> None:
    store(numbers, tmp_path)
    path = tmp_path / f"{COHORT}.csv"
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    first, second, third, fourth = table["quantity"][:4]
    table.loc[0, "quantity"] = "observation/another"
    table.loc[[2, 3], "value"] = ["many", ""]
    table.drop(index=1).to_csv(path, index=False)
    named = differences(numbers, tmp_path)["quantity"]
    assert sorted(named) == sorted(["observation/another", first, second, third, fourth])
